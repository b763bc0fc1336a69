"""Reads over the years: results of a building's events by their latest analysis, and its alerts."""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from datetime import datetime

from sqlalchemy import ColumnElement, func, or_, select, tuple_
from sqlalchemy.orm import Session

from service.alerts.tables import Alert, AlertChange, Inspection
from service.analyses.tables import (
    Analysis,
    CycleResult,
    DirectionResult,
    LayerResult,
    ModeResult,
    SensorResult,
    ShakingResult,
)
from service.db.select import Line, Place, Question, Span
from service.drift.tables import DriftValue, MonitoredSeries, ReferencePeriod
from service.records.tables import Event

CYCLE = ("start", "end", "amplitude", "shear_strain", "k_eq", "k_eq_std", "c_eq", "c_eq_std")
MODE = ("number", "frequency", "frequency_std", "damping_ratio", "damping_ratio_std")


def temperatures(
    session: Session, building_id: int, events: Collection[int] | None = None
) -> Sequence[tuple[int, float]]:
    """(event id, °C) of each event, or each of some, with a measured temperature."""
    query = _events(building_id, events).add_columns(Analysis.temperature).where(Analysis.temperature.is_not(None))
    return [(row.event, row.temperature) for row in session.execute(query)]


def analysed_since(session: Session, building_id: int, since: datetime) -> int:
    """Number of analysed events that began at `since` or later."""
    query = _events(building_id).where(Event.start >= since).subquery()
    return session.scalar(select(func.count()).select_from(query)) or 0


def directions(session: Session, building_id: int, events: Collection[int] | None = None) -> Sequence[Line]:
    """Every direction of every event, or of some, the earliest event first; `result` is its number."""
    query = _directions(building_id, events).add_columns(
        DirectionResult.id.label("result"), DirectionResult.start.label("record_start")
    )
    return session.execute(query.order_by(Event.start, Event.id, DirectionResult.id)).all()


def all_cycles(session: Session, building_id: int, events: Collection[int] | None = None) -> Sequence[Line]:
    """Numbers of every cycle of every event, or of some, in any order; `result` is the number of its direction."""
    names = ("start", "end", "amplitude", "k_eq", "k_eq_std", "c_eq", "c_eq_std")
    columns = [CycleResult.__table__.c[name] for name in ("result_id", "id", *names)]
    query = (
        select(*columns)
        .join(DirectionResult, DirectionResult.id == CycleResult.result_id)
        .join(Analysis, (Analysis.id == DirectionResult.analysis_id) & Analysis.current)
        .join(Event, Event.id == Analysis.event_id)
        .where(Event.building_id == building_id)
    )
    return session.execute(query if events is None else query.where(Event.id.in_(events))).all()


def residuals(session: Session, building_id: int, events: Collection[int] | None = None) -> Sequence[Line]:
    """Residual displacement of the layer in each direction, m, in every event, or in some."""
    value, std = DirectionResult.residual_displacement, DirectionResult.residual_displacement_std
    query = _directions(building_id, events).add_columns(value.label("value"), std.label("std"))
    return session.execute(query.where(value.is_not(None)).order_by(Event.start, Event.id)).all()


def peak_displacements(session: Session, building_id: int) -> Sequence[Line]:
    """Peak displacement of the layer in each direction, m; None where it was not measured."""
    query = _directions(building_id).add_columns(DirectionResult.peak_displacement.label("peak"))
    return session.execute(query.order_by(Event.start, Event.id)).all()


def sensors(session: Session, building_id: int, events: Collection[int] | None = None) -> Sequence[Line]:
    """Noise and gain of every channel in every event, or in some."""
    columns = (SensorResult.channel, SensorResult.noise, SensorResult.gain, SensorResult.gain_std)
    query = (
        _events(building_id, events).join(SensorResult, SensorResult.analysis_id == Analysis.id).add_columns(*columns)
    )
    return session.execute(query.order_by(Event.start, Event.id, SensorResult.channel)).all()


def analysed_events(session: Session, building_id: int) -> Sequence[Line]:
    """Number and data quality findings of the latest analysis of each event, the earliest event first."""
    query = _events(building_id).add_columns(Analysis.id.label("analysis"), Analysis.quality)
    return session.execute(query.order_by(Event.start, Event.id)).all()


def reference_periods(session: Session, building_id: int) -> Sequence[ReferencePeriod]:
    """Reference periods of a building, in the order in which they were set."""
    query = select(ReferencePeriod).where(ReferencePeriod.building_id == building_id)
    return session.scalars(query.order_by(ReferencePeriod.id)).all()


def cycles(
    session: Session, building_id: int, span: Span, direction: str | None, cursor: Place | None, limit: int
) -> Sequence[Line]:
    """Every cycle of every event's latest analysis, the earliest first; the last column is the cycle's id."""
    query = _cycles(building_id, span, direction)
    if cursor is not None:
        query = query.where(tuple_(Event.start, CycleResult.id) > tuple_(cursor.time, cursor.id))
    return session.execute(query.order_by(Event.start, CycleResult.id).limit(limit)).all()


def latest_cycles(session: Session, building_id: int, direction: str, limit: int) -> Sequence[Line]:
    """The latest so many cycles, the earliest of them first; columns as those of `cycles`."""
    query = _cycles(building_id, Span(), direction)
    latest = session.execute(query.order_by(Event.start.desc(), CycleResult.id.desc()).limit(limit)).all()
    return latest[::-1]


def modes(
    session: Session, building_id: int, span: Span, direction: str | None, cursor: Place | None, limit: int
) -> Sequence[Line]:
    """Every mode of every event's latest analysis, the earliest first; the last column is the mode's id."""
    of_mode = [ModeResult.__table__.c[name] for name in MODE]
    query = _span_directions(building_id, span, direction).add_columns(*of_mode)
    query = query.join(ModeResult, ModeResult.result_id == DirectionResult.id).add_columns(ModeResult.id)
    if cursor is not None:
        query = query.where(tuple_(Event.start, ModeResult.id) > tuple_(cursor.time, cursor.id))
    return session.execute(query.order_by(Event.start, ModeResult.id).limit(limit)).all()


def _cycles(building_id: int, span: Span, direction: str | None) -> Question:
    """Every cycle of every event's latest analysis; the last column is the cycle's id."""
    of_cycle = [CycleResult.__table__.c[name] for name in CYCLE]
    query = _span_directions(building_id, span, direction).add_columns(
        DirectionResult.start.label("record_start"), *of_cycle
    )
    return query.join(CycleResult, CycleResult.result_id == DirectionResult.id).add_columns(CycleResult.id)


def largest_before(session: Session, event: Event) -> float | None:
    """m, largest displacement in plan in the building's earthquakes before this one; None where none was measured."""
    moved = func.coalesce(LayerResult.peak_resultant, DirectionResult.peak_displacement)
    query = _moved(event.building_id).with_only_columns(func.max(moved)).where(Event.start < event.start)
    return session.scalar(query)


def largest_displacements(session: Session, building_id: int) -> Sequence[tuple[datetime, float]]:
    """Start of each earthquake with a known displacement, and its largest in plan (m), the earliest first."""
    moved = func.max(func.coalesce(LayerResult.peak_resultant, DirectionResult.peak_displacement))
    query = _moved(building_id).with_only_columns(Event.start, moved).group_by(Event.id, Event.start)
    rows = session.execute(query.having(moved.is_not(None)).order_by(Event.start, Event.id))
    return [(start, value) for start, value in rows]


def moved_far(
    session: Session,
    building_id: int,
    since: datetime | None,
    displacement: float,
    residual: float,
    shaking: Mapping[str, float],
    others: Collection[int] = (),
) -> Sequence[Line]:
    """(Event, Analysis) of the earthquakes that reached one of these values, the earliest first.

    Args:
        session: to read with.
        building_id: of the building.
        since: earthquakes that ended before are left out; None: none is.
        displacement: m, in one direction.
        residual: m, in one direction.
        shaking: by column of ShakingResult.
        others: numbers of earthquakes that count whatever their values.
    """
    far = or_(
        DirectionResult.peak_displacement >= displacement,
        func.abs(DirectionResult.residual_displacement) >= residual,
        *(ShakingResult.__table__.c[name] >= value for name, value in shaking.items()),
        Event.id.in_(others),
    )
    shaken = _moved(building_id).outerjoin(ShakingResult, ShakingResult.analysis_id == Analysis.id)
    query = shaken.with_only_columns(Event.id).where(far)
    if since is not None:
        query = query.where(Event.end > since)
    both = select(Event, Analysis).join(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
    return session.execute(both.where(Event.id.in_(query)).order_by(Event.start, Event.id)).all()


def last_inspection(session: Session, building_id: int, cause: str) -> datetime | None:
    """Time of the last inspection that ended an alert of that cause; None where there was none."""
    of_cause = (Alert.building_id == building_id, Alert.cause == cause)
    return session.scalar(select(func.max(Inspection.at)).join(Alert, Alert.id == Inspection.alert_id).where(*of_cause))


def stiffness_values(session: Session, event: Event) -> Sequence[Line]:
    """(subject, wanted, corrections, DriftValue | None): the building's series of stiffness, with the event's value."""
    value = (DriftValue.series_id == MonitoredSeries.id) & (DriftValue.event_id == event.id)
    of_stiffness = (MonitoredSeries.building_id == event.building_id, MonitoredSeries.quantity == "stiffness")
    query = select(MonitoredSeries.subject, MonitoredSeries.wanted).add_columns(*corrections(), DriftValue)
    query = query.outerjoin(DriftValue, value)
    return session.execute(query.where(*of_stiffness).order_by(MonitoredSeries.subject)).all()


def corrections() -> tuple[ColumnElement[float | None], ...]:
    """°C, mean temperature of a series' reference, and 1/year, hardening of the rubber that its baseline expects.

    Null where the baseline does not use it.
    """
    design = MonitoredSeries.baseline["design"]
    return design["temperature"].as_float(), design["ageing"]["rate"].as_float()


def open_at(session: Session, building_id: int, at: datetime | None) -> Sequence[tuple[Alert, str]]:
    """(alert, its state at that time) of the alerts open at a time, or open now (None), by number."""
    if at is None:
        now_open = select(Alert).where(Alert.building_id == building_id, Alert.closed_at.is_(None)).order_by(Alert.id)
        return [(one, one.state) for one in session.scalars(now_open)]
    return open_at_each(session, building_id, [at])[at]


def open_at_each(
    session: Session, building_id: int, times: Collection[datetime]
) -> Mapping[datetime, Sequence[tuple[Alert, str]]]:
    """By time, what `open_at` gives; the statements are as many as for one of the times."""
    if not times:
        return {}
    was_open = (
        Alert.building_id == building_id,
        Alert.opened_at <= max(times),
        or_(Alert.closed_at.is_(None), Alert.closed_at > min(times)),
    )
    alerts = session.scalars(select(Alert).where(*was_open).order_by(Alert.id)).all()
    changes = _changes(session, [one.id for one in alerts], max(times))
    return {
        at: [(one, _state_at(one, changes[one.id], at)) for one in alerts if _was_open(one, at)] for at in set(times)
    }


def ended(session: Session, building_id: int) -> Sequence[Alert]:
    """The building's alerts that were active and have ended, by number."""
    has_ended = (Alert.building_id == building_id, Alert.closed_at.is_not(None), Alert.activated_at.is_not(None))
    return session.scalars(select(Alert).where(*has_ended).order_by(Alert.id)).all()


def _changes(session: Session, numbers: Collection[int], until: datetime) -> Mapping[int, list[Line]]:
    """By alert, its changes up to a time, in their order."""
    query = select(AlertChange.alert_id, AlertChange.at, AlertChange.state).where(AlertChange.alert_id.in_(numbers))
    changes: dict[int, list[Line]] = defaultdict(list)
    for change in session.execute(query.where(AlertChange.at <= until).order_by(AlertChange.id)):
        changes[change.alert_id].append(change)
    return changes


def _was_open(alert: Alert, at: datetime) -> bool:
    return alert.opened_at <= at and (alert.closed_at is None or alert.closed_at > at)


def _state_at(alert: Alert, changes: Sequence[Line], at: datetime) -> str:
    return next((change.state for change in reversed(changes) if change.at <= at), alert.state)


def _moved(building_id: int) -> Question:
    """Directions of the latest usable analysis of every event of a building."""
    return (
        select(Event)
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current & Analysis.refusal.is_(None))
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .outerjoin(LayerResult, LayerResult.analysis_id == Analysis.id)
        .where(Event.building_id == building_id)
    )


def _span_directions(building_id: int, span: Span, direction: str | None) -> Question:
    """The directions of events in a span of time, or one of them."""
    query = _directions(building_id)
    return span.limit(query if direction is None else query.where(DirectionResult.direction == direction))


def modes_of_direction(
    session: Session, building_id: int, direction: str, events: Collection[int] | None, most: int
) -> Sequence[Line]:
    """A row for each mode in every event, or in some of them, the earliest first; the latest `most` events at most."""
    of_direction = _directions(building_id, events).where(DirectionResult.direction == direction)
    with_modes = of_direction.where(DirectionResult.modes.any()).order_by(Event.start.desc(), Event.id.desc())
    latest = (
        with_modes.add_columns(DirectionResult.id.label("result"), DirectionResult.peak_force).limit(most).subquery()
    )
    of_mode = (ModeResult.frequency, ModeResult.frequency_std, ModeResult.shape)
    query = select(latest.c.event, latest.c.event_start, latest.c.peak_force, *of_mode)
    query = query.join(ModeResult, ModeResult.result_id == latest.c.result)
    return session.execute(query.order_by(latest.c.event_start, latest.c.event, ModeResult.number)).all()


def _directions(building_id: int, events: Collection[int] | None = None) -> Question:
    """Events of a building, or some of them, with the directions of their latest analysis."""
    joined = _events(building_id, events).join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
    return joined.add_columns(DirectionResult.direction)


def _events(building_id: int, events: Collection[int] | None = None) -> Question:
    """Events of a building, or some of them, with their latest analysis."""
    columns = (Event.id.label("event"), Event.start.label("event_start"))
    latest = (Analysis.event_id == Event.id) & Analysis.current
    query = select(*columns).join(Analysis, latest).where(Event.building_id == building_id)
    return query if events is None else query.where(Event.id.in_(events))
