"""Reads of a building's drift as last monitored, as rows of the API and the pages."""

from collections.abc import Mapping, Sequence
from operator import attrgetter

from sqlalchemy import func, select, tuple_
from sqlalchemy.orm import Session, joinedload

from core.drift.quantities import QUANTITIES
from service.db.select import Line, Place, Question, Span
from service.drift.schema import DriftAlarmRow, ObservationRow, SeriesRow
from service.drift.series import monitored_series
from service.drift.tables import DriftAlarm, DriftValue, MonitoredSeries
from service.errors import NotFoundError
from service.records.tables import Event

LAST = 20
"""Events among which the latest value of most series is."""


def every_series(session: Session, building_id: int) -> Sequence[MonitoredSeries]:
    """Every monitored series of a building, by quantity and subject."""
    query = select(MonitoredSeries).where(MonitoredSeries.building_id == building_id)
    return session.scalars(query.order_by(MonitoredSeries.quantity, MonitoredSeries.subject)).all()


def one_series(session: Session, building_id: int, quantity: str, subject: str) -> MonitoredSeries:
    """A series of a building.

    Raises:
        NotFoundError: no series of that name was monitored there.
    """
    named = (MonitoredSeries.quantity == quantity, MonitoredSeries.subject == subject)
    row = session.scalars(
        select(MonitoredSeries).where(MonitoredSeries.building_id == building_id, *named)
    ).one_or_none()
    if row is None:
        raise NotFoundError("monitored series", f"{quantity}/{subject}")
    return row


def values(
    session: Session,
    building_id: int,
    span: Span,
    quantity: str | None,
    subject: str | None,
    cursor: Place | None,
    limit: int,
) -> Sequence[Line]:
    """Every event's value in these series, the earliest event first; the last column is the value's id."""
    of_value = ("value", "std", "count", "is_reference", "is_beyond", "is_excluded", "causes")
    query: Question = (
        select(
            Event.id.label("event"),
            Event.start.label("event_start"),
            MonitoredSeries.quantity,
            MonitoredSeries.subject,
            *(DriftValue.__table__.c[name] for name in of_value),
            DriftValue.id,
        )
        .join(DriftValue, DriftValue.event_id == Event.id)
        .join(MonitoredSeries, MonitoredSeries.id == DriftValue.series_id)
        .where(MonitoredSeries.building_id == building_id)
    )
    for column, wanted in ((MonitoredSeries.quantity, quantity), (MonitoredSeries.subject, subject)):
        if wanted is not None:
            query = query.where(column == wanted)
    if cursor is not None:
        query = query.where(tuple_(Event.start, DriftValue.id) > tuple_(cursor.time, cursor.id))
    return session.execute(span.limit(query).order_by(Event.start, DriftValue.id).limit(limit)).all()


def counts(session: Session, building_id: int) -> Mapping[int, int]:
    """Number of values by series; series without values are missing."""
    query = select(DriftValue.series_id, func.count()).group_by(DriftValue.series_id)
    query = query.join(MonitoredSeries).where(MonitoredSeries.building_id == building_id)
    return dict(session.execute(query).all())


def latest_values(session: Session, building_id: int) -> Mapping[int, DriftValue]:
    """The value of the latest event of each series, by series.

    Most series have one of the last events; the others are read one by one.
    """
    series = session.scalars(select(MonitoredSeries.id).where(MonitoredSeries.building_id == building_id)).all()
    of_time = (Event.start.desc(), Event.id.desc())
    last = select(Event.id).where(Event.building_id == building_id).order_by(*of_time).limit(LAST).subquery()
    query = select(DriftValue).join(Event, Event.id == DriftValue.event_id).where(DriftValue.series_id.in_(series))
    found: dict[int, DriftValue] = {}
    for value in session.scalars(query.where(DriftValue.event_id.in_(select(last.c.id))).order_by(*of_time)):
        found.setdefault(value.series_id, value)
    rest = {number: latest_value(session, number) for number in set(series) - found.keys()}
    return found | {number: value for number, value in rest.items() if value is not None}


def latest_value(session: Session, series: int) -> DriftValue | None:
    """The value of the latest event of a series."""
    query = select(DriftValue).join(Event, Event.id == DriftValue.event_id).where(DriftValue.series_id == series)
    return session.scalars(query.order_by(Event.start.desc(), Event.id.desc()).limit(1)).one_or_none()


def sure_alarms(session: Session, building_id: int) -> Mapping[int, int]:
    """Number of alarms that the rules are sure of, by series; series without one are missing."""
    query = select(DriftAlarm.series_id, func.count()).join(MonitoredSeries).group_by(DriftAlarm.series_id)
    return dict(session.execute(query.where(MonitoredSeries.building_id == building_id, DriftAlarm.is_sure)).all())


def alarms(session: Session, building_id: int) -> Sequence[DriftAlarm]:
    """Alarms by quantity and subject, in the order in which they were raised, with their series and events."""
    query = select(DriftAlarm).join(DriftAlarm.series).where(MonitoredSeries.building_id == building_id)
    loaded = query.options(
        *(
            joinedload(one)
            for one in (DriftAlarm.series, DriftAlarm.onset, DriftAlarm.after, DriftAlarm.by, DriftAlarm.raised)
        )
    )
    return session.scalars(loaded.order_by(MonitoredSeries.quantity, MonitoredSeries.subject, DriftAlarm.id)).all()


def series_rows(session: Session, building_id: int) -> list[SeriesRow]:
    """Every monitored series of a building with its latest value."""
    numbers, latest = counts(session, building_id), latest_values(session, building_id)
    sure = sure_alarms(session, building_id)
    return [
        SeriesRow(
            quantity=series.quantity,
            subject=series.subject,
            title=QUANTITIES[series.quantity].title,
            events=numbers.get(series.id, 0),
            wanted=series.wanted,
            latest_event=None if last is None else last.event_id,
            latest_value=None if last is None else last.value,
            latest_std=None if last is None else last.std,
            latest_is_excluded=last is not None and last.is_excluded,
            latest_is_beyond=last is not None and last.is_beyond,
            alarms=sure.get(series.id, 0),
            monitored_at=series.created_at,
        )
        for series in every_series(session, building_id)
        for last in [latest.get(series.id)]
    ]


def observations(
    session: Session, building_id: int, quantity: str, subject: str, event: int | None
) -> list[ObservationRow]:
    """The measurements of a series, in order of time.

    Raises:
        NotFoundError: no series of that name is measured at the building.
    """
    for series in monitored_series(session, building_id, (quantity,), None if event is None else (event,)):
        if series.subject == subject:
            wanted = [one for one in series.measurements if event is None or one.event == event]
            return [ObservationRow.model_validate(one) for one in sorted(wanted, key=attrgetter("time", "event"))]
    raise NotFoundError("monitored series", f"{quantity}/{subject}")


def alarm_rows(session: Session, building_id: int) -> list[DriftAlarmRow]:
    """Alarms of a building."""
    return [_alarm_row(alarm) for alarm in alarms(session, building_id)]


def _alarm_row(alarm: DriftAlarm) -> DriftAlarmRow:
    return DriftAlarmRow(
        quantity=alarm.series.quantity,
        subject=alarm.series.subject,
        rule=alarm.rule,
        is_sure=alarm.is_sure,
        onset_event=alarm.onset_event_id,
        onset_start=alarm.onset.start,
        after_event=alarm.after_event_id,
        changed_after=None if alarm.after is None else alarm.after.start,
        by_event=alarm.by_event_id,
        changed_by=None if alarm.by is None else alarm.by.start,
        raised_event=alarm.raised_event_id,
        raised_start=alarm.raised.start,
        events=alarm.event_ids,
        drift=alarm.drift,
        low=alarm.low,
        high=alarm.high,
        false_alarms=alarm.false_alarms,
        causes=alarm.causes,
        message=alarm.message,
    )
