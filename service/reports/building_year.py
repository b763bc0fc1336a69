"""Alerts, inspections and messages of a building's year, and times without records, as lines of a report."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from zoneinfo import ZoneInfo

from sqlalchemy import ColumnElement, func, select
from sqlalchemy.orm import InstrumentedAttribute, Session, joinedload, selectinload

from service.alerts.tables import Alert, BuildingInspection, Inspection
from service.buildings.tables import Building
from service.db.select import Question
from service.language.translation import said
from service.notify.tables import Delivery, Message
from service.records.tables import REJECTED, Event, Recording
from service.reports import texts
from service.reports.earthquake import Fact
from service.reports.texts import clipped, shown
from service.verdict import texts as verdict_texts

OPEN, NOW = "open", "now"
LISTED = 1000
"""Rows of a table: the strongest earthquakes, the latest messages."""


@dataclass(frozen=True, slots=True)
class BuildingYear:
    """A building's year in its time zone."""

    session: Session
    building: Building
    start: datetime
    end: datetime
    zone: ZoneInfo
    at: datetime | None
    """Time as of which alerts are open; None: now, because the year is not over."""

    def holds(self, column: InstrumentedAttribute[datetime]) -> ColumnElement[bool]:
        """Condition that a time lies in the year."""
        return (column >= self.start) & (column < self.end)

    def events(self, query: Question) -> Question:
        """A query of events limited to those of the year."""
        return query.where(Event.building_id == self.building.id, self.holds(Event.start))

    def local(self, moment: datetime | None, instead: str = "") -> str:
        """A time as the building's people read it."""
        return instead if moment is None else f"{moment.astimezone(self.zone):%Y-%m-%d %H:%M}"


@dataclass(frozen=True, slots=True, kw_only=True)
class AlertLine:
    """One alert that was open in the year."""

    number: int
    summary: str
    began: str
    state: str
    answered: str
    """Person who acknowledged it, with the time, and the one to whom it is assigned; empty where there is none."""
    ended: str


@dataclass(frozen=True, slots=True, kw_only=True)
class InspectionLine:
    """One inspection of the building, or one that ended an alert, or review of the data."""

    time: str
    by: str
    subject: str
    outcome: str
    note: str


@dataclass(frozen=True, slots=True, kw_only=True)
class MessageLine:
    """One message of the year."""

    time: str
    subject: str
    recipients: str
    """Each with the state of its delivery."""


def alert_lines(of: BuildingYear) -> tuple[AlertLine, ...]:
    """Alerts that were active, and open at some time of the year, by number."""
    return tuple(_alert_line(of, one) for one in _alerts(of))


def _alerts(of: BuildingYear) -> Sequence[Alert]:
    was_open = (Alert.opened_at < of.end) & (Alert.closed_at.is_(None) | (Alert.closed_at >= of.start))
    query = select(Alert).where(Alert.building_id == of.building.id, was_open, Alert.activated_at.is_not(None))
    return of.session.scalars(query.order_by(Alert.id)).all()


def _alert_line(of: BuildingYear, alert: Alert) -> AlertLine:
    return AlertLine(
        number=alert.id,
        summary=shown(alert.summary),
        began=of.local(alert.began_at),
        state=said(verdict_texts.STATE_NAMES.get(alert.state, alert.state)),
        answered=clipped("; ".join(_answers(of, alert))),
        ended=of.local(alert.closed_at, said(OPEN)),
    )


def _answers(of: BuildingYear, alert: Alert) -> Iterator[str]:
    if alert.acknowledged_by is not None:
        note = alert.acknowledgement or ""
        yield f"{alert.acknowledged_by}, {of.local(alert.acknowledged_at)}: {note}".rstrip(": ")
    if alert.assigned_to is not None:
        yield said(f"assigned to {alert.assigned_to}")


def inspection_lines(of: BuildingYear) -> Iterator[InspectionLine]:
    """Inspections of the building, then those and the reviews of data that ended an alert, each in order of time."""
    signed = select(BuildingInspection).where(BuildingInspection.building_id == of.building.id)
    in_order = signed.where(of.holds(BuildingInspection.inspected_at)).order_by(BuildingInspection.inspected_at)
    for row in of.session.scalars(in_order):
        yield InspectionLine(
            time=of.local(row.inspected_at),
            by=clipped(row.by, texts.LONGEST_NAME),
            subject=shown(f"The building, with the verdict {row.headline}"),
            outcome=said(verdict_texts.RESULTS[row.result]),
            note=clipped(row.comment, 2000),
        )
    query = select(Inspection).options(joinedload(Inspection.alert)).join(Inspection.alert)
    query = query.where(Alert.building_id == of.building.id, of.holds(Inspection.at)).order_by(Inspection.at)
    for one in of.session.scalars(query):
        yield InspectionLine(
            time=of.local(one.at),
            by=clipped(one.by, texts.LONGEST_NAME),
            subject=shown(f"Alert {one.alert_id}: {one.alert.summary}"),
            outcome=said(one.outcome),
            note=clipped(one.note, 2000),
        )


def message_lines(of: BuildingYear) -> tuple[tuple[MessageLine, ...], tuple[str, ...]]:
    """Messages of the year in order of time, with drills and tests marked; a sentence about those that are omitted."""
    query = select(Message).where(Message.building_id == of.building.id, of.holds(Message.created_at))
    total = of.session.scalar(query.with_only_columns(func.count())) or 0
    loaded = query.options(selectinload(Message.deliveries).joinedload(Delivery.receiver))
    rows = of.session.scalars(loaded.order_by(Message.id.desc()).limit(LISTED)).all()
    lines = tuple(
        MessageLine(time=of.local(one.created_at), subject=_subject(one), recipients=_recipients(of, one))
        for one in rows[::-1]
    )
    return lines, () if total <= LISTED else (f"{total - LISTED} earlier messages of the year are not listed.",)


def _subject(message: Message) -> str:
    mark = {"drill": "DRILL: ", "test": "TEST: "}.get(message.kind, "")
    order = "" if message.sequence == "new" else f"{message.sequence}: "
    return shown(f"{mark}{order}{message.subject}", 200)


def _recipients(of: BuildingYear, message: Message) -> str:
    """Recipients by name, without their addresses."""
    if not message.deliveries:
        return said(message.unsent or "no recipients")
    parts = (
        f"{one.receiver.name} ({said(one.receiver.kind)}) {said(one.state)} {of.local(one.finished_at)}".rstrip()
        for one in message.deliveries
    )
    return clipped(", ".join(parts))


def gaps(of: BuildingYear) -> Iterator[Fact]:
    """Times when records did not arrive, and files and earthquakes that could not be used."""
    for alert in _alerts(of):
        if alert.kind == "data":
            yield Fact(
                f"{of.local(alert.began_at)} – {of.local(alert.closed_at, said(NOW))}", shown(alert.summary, 200)
            )
    unusable = select(func.count()).select_from(Event).where(Event.state.in_(("refused", "failed")))
    if count := of.session.scalar(of.events(unusable)):
        yield Fact("Earthquakes without a result", f"{count}, with their reasons in the table above")
    rejected = select(func.count()).where(Recording.building_id == of.building.id, REJECTED)
    if count := of.session.scalar(rejected.where(of.holds(Recording.received_at))):
        yield Fact("Files that could not be used", str(count))
