"""The years of a building in one picture: level of each earthquake, alerts, inspections and changes of the model."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.alerts.tables import Alert, BuildingInspection, Inspection
from service.buildings.tables import Building
from service.models.tables import ModelVersion
from service.records.tables import Event
from service.verdict import texts
from service.verdict.checks import LEVELS, Level
from service.verdict.earthquakes import PastEvent, past_events

MOST = 200
"""Earthquakes that a timeline shows at most: the latest."""
LEFT, RIGHT, LANE, TOP = 102.0, 466.0, 24.0, 8.0
"""Units of the drawing: ends of the axis of time, height of a lane, and the first one's edge."""
LANES = ("alerts", "inspections", "model")
"""Lanes below those of the levels."""


@dataclass(frozen=True, slots=True)
class Mark:
    """An earthquake, or an event in the life of the building."""

    at: datetime
    x: float
    y: float
    text: str
    address: str
    level: Level | None = None
    """Level of an earthquake."""
    until: float | None = None
    """End of an alert, in units of the drawing."""


@dataclass(frozen=True, slots=True)
class Timeline:
    """A timeline, ready to be drawn."""

    height: float
    lanes: Sequence[tuple[str, float]]
    """Name and middle of each."""
    ticks: Sequence[tuple[str, float]]
    """Name and place of the years, or of the days of a short time."""
    earthquakes: Sequence[Mark]
    others: Sequence[Mark]
    summary: str

    @property
    def latest_first(self) -> Sequence[Mark]:
        """Everything, for a table."""
        return sorted((*self.earthquakes, *self.others), key=lambda one: one.at, reverse=True)


def timeline(session: Session, building: Building, until: datetime, most: int = MOST) -> Timeline | None:
    """The building's timeline until then, with its latest earthquakes; None before the first earthquake."""
    past = past_events(session, building, most)
    if not past:
        return None
    first, last = past[0].event.start, max(until, past[-1].event.end)
    scale = (RIGHT - LEFT) / max((last - first) / timedelta(seconds=1), 1.0)

    def x(moment: datetime) -> float:
        return round(LEFT + scale * max((moment - first) / timedelta(seconds=1), 0.0), 1)

    shown = [level for level in LEVELS if level in {one.verdict.level for one in past}]
    others = list(_happenings(session, building, first, last))
    names = [*(level.words for level in shown), *(lane for lane in LANES if any(one[0] == lane for one in others))]
    middle = {name: TOP + LANE * (number + 0.5) for number, name in enumerate(names)}
    return Timeline(
        height=TOP + LANE * len(names) + 22,
        lanes=list(middle.items()),
        ticks=[(name, x(at)) for name, at in _ticks(first, last)],
        earthquakes=[
            Mark(
                at=one.event.start,
                x=x(one.event.start),
                y=middle[one.verdict.level.words],
                text=", ".join(part for part in (one.verdict.level.words, texts.moved(one.verdict)) if part),
                address=f"/events/{one.event.id}",
                level=one.verdict.level,
            )
            for one in past
        ],
        others=[
            Mark(at, x(at), middle[lane], text, address, until=None if until is None else x(until))
            for lane, at, until, text, address in others
        ],
        summary=_summary(past, len(past) if len(past) < most else _count(session, building)),
    )


Happening = tuple[str, datetime, datetime | None, str, str]
"""Lane, beginning, end where it has one, words and address."""


def _happenings(session: Session, building: Building, first: datetime, last: datetime) -> Iterator[Happening]:
    """Alerts, inspections and changes of the model since the first earthquake."""
    alerts = select(Alert).where(Alert.building_id == building.id, Alert.activated_at.is_not(None)).order_by(Alert.id)
    for alert in session.scalars(alerts):
        end, state = alert.closed_at or last, texts.STATE_NAMES.get(alert.state, alert.state)
        if end >= first:
            began = max(alert.began_at, first)
            yield "alerts", began, end, f"{alert.summary} ({state})", f"/alerts/{alert.id}"
    ended = select(Inspection).join(Alert, Alert.id == Inspection.alert_id).where(Alert.building_id == building.id)
    for one in session.scalars(ended.order_by(Inspection.id)):
        words = f"{one.by}: {one.outcome}, alert {one.alert_id}"
        yield "inspections", one.at, None, words, f"/alerts/{one.alert_id}"
    signed = select(BuildingInspection).where(BuildingInspection.building_id == building.id)
    for row in session.scalars(signed.order_by(BuildingInspection.id)):
        if row.inspected_at >= first:
            words = f"inspected by {row.by}: {texts.RESULTS[row.result]}"
            yield "inspections", row.inspected_at, None, words, f"/buildings/{building.code}"
    models = select(ModelVersion).where(ModelVersion.building_id == building.id, ModelVersion.accepted_at.is_not(None))
    for model in session.scalars(models.order_by(ModelVersion.id)):
        if model.accepted_at is not None and model.accepted_at >= first:
            words = f"model {model.direction} {model.number} put in force by {model.accepted_by}"
            yield "model", model.accepted_at, None, words, f"/models/{model.id}"


def _ticks(first: datetime, last: datetime) -> Iterator[tuple[str, datetime]]:
    """Beginnings of years; of a time within one year, its two ends."""
    years = range(first.year + 1, last.year + 1)
    if not years:
        yield f"{first:%Y-%m-%d}", first
        return
    for year in years[:: max(1, len(years) // 6 + 1)]:
        yield str(year), datetime(year, 1, 1, tzinfo=UTC)


def _count(session: Session, building: Building) -> int:
    """Number of earthquakes of a building, shown or not."""
    return session.scalar(select(func.count()).where(Event.building_id == building.id)) or 0


def _summary(past: Sequence[PastEvent], recorded: int) -> str:
    """`38 earthquakes from 2023 to 2026: 2 inspect, 36 normal`, or the latest of them where there are more."""
    counts = [(level.words, sum(one.verdict.level is level for one in past)) for level in LEVELS]
    listed = ", ".join(f"{count} {words}" for words, count in counts if count)
    first, last = past[0].event.start.year, past[-1].event.start.year
    years = f"in {first}" if first == last else f"from {first} to {last}"
    if recorded > len(past):
        return f"The latest {len(past)} of {recorded} earthquakes, {years}: {listed}"
    return f"{len(past)} earthquake{'s' if len(past) > 1 else ''} {years}: {listed}"
