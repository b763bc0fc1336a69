"""Monitoring of a building for drift: inputs read from the database, one computation, and results written back."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from sqlalchemy import bindparam, delete, insert, select, update
from sqlalchemy.orm import Session, selectinload

from core.drift.ageing import Ageing, ageing_of
from core.drift.alarms import Alarm
from core.drift.baseline import Baseline
from core.drift.deviations import EventNotes, EventValue
from core.drift.from_analyses import channels_of, sensor_notes
from core.drift.monitor import Monitoring, Reference, monitor
from core.drift.pooled import pooled
from core.drift.quantities import BOTH_DIRECTIONS, LAYER_QUANTITIES
from core.drift.series import Series
from core.record import Finding
from service.alerts.messages import write_messages
from service.alerts.reconciliation import reconcile
from service.analyses import history
from service.buildings.reference_periods import in_force, reference
from service.buildings.store import described
from service.buildings.tables import Building
from service.drift.alert_candidates import drift_candidates, limit_candidates
from service.drift.baseline import read, written
from service.drift.series import monitored_series
from service.drift.tables import DriftAlarm, DriftValue, MonitoredSeries, ReferencePeriod
from service.jobs.queue import WATCH, Claim
from service.jobs.stages import Stage
from service.jobs.tables import Job
from service.settings import Settings
from service.version import VERSION


@dataclass(frozen=True, slots=True)
class SeriesInputs:
    """One series with everything that its monitoring needs."""

    series: Series
    reference: Reference
    notes: Mapping[int, EventNotes]
    """By event."""
    reference_id: int | None
    channels: tuple[str, ...]
    """Channels that measure it."""
    ageing: Ageing | None = None
    """Hardening of the building's rubber; None where it is not known."""
    earlier: Baseline | None = None
    """As this version of the code fitted it last; None if it did not."""


@dataclass(frozen=True, slots=True)
class MonitoringInputs:
    """All series of a building."""

    building_id: int
    series_inputs: tuple[SeriesInputs, ...]
    starts: Mapping[int, datetime]
    """Start of every analysed event."""
    timezone: str
    """IANA name of the building's time zone."""
    message_age: timedelta
    """Age up to which an event causes messages."""


def inputs(session: Session, claim: Claim, settings: Settings) -> MonitoringInputs:
    """The monitored series of a claimed job's building, as stored now."""
    building = session.get_one(Building, claim.building_id)
    file = described(session, building)
    events = history.findings(session, building.id)
    noted = {row.event: [Finding(**one) for one in row.quality] for row in events}
    periods = history.reference_periods(session, building.id)
    ageing = ageing_of(file.description.isolation.rubber, file.description.isolation.installed)
    fitted = _fitted(session, building.id)
    series_inputs = [
        _series_inputs(
            series,
            channels_of(series, file.description),
            noted,
            in_force(periods, series.quantity, series.subject),
            ageing,
            fitted.get((series.quantity, series.subject)),
        )
        for series in monitored_series(session, building.id)
    ]
    return MonitoringInputs(
        building_id=building.id,
        series_inputs=tuple(series_inputs),
        starts={row.event: row.event_start for row in events},
        timezone=file.timezone,
        message_age=timedelta(seconds=settings.notify.max_event_age),
    )


def stages(inputs: MonitoringInputs) -> Sequence[Stage]:
    """All series at once: each takes a fraction of a second."""
    return (Stage("Looking for drift", monitored, lambda _, report_step: (inputs.series_inputs,)),)


def monitored(series_inputs: Sequence[SeriesInputs]) -> tuple[tuple[SeriesInputs, Monitoring], ...]:
    """Baseline, values and alarms of each series, then of the mean of both directions of the layer."""
    own = [(one, monitor(one.series, one.reference, one.notes, one.ageing, one.earlier)) for one in series_inputs]
    return (*own, *_pooled(own))


def store(
    session: Session,
    claim: Claim,
    inputs: MonitoringInputs,
    results: Sequence[Sequence[tuple[SeriesInputs, Monitoring]]],
    now: datetime,
) -> None:
    """Bring the building's drift up to date and notify its recipients, unless a later job will."""
    if _is_overtaken(session, claim, inputs.building_id):
        return
    pairs = results[-1]
    _update(session, claim, inputs.building_id, pairs, now)
    monitorings = [(monitored, series_inputs.channels) for series_inputs, monitored in pairs]
    changes = drift_candidates(monitorings, inputs.starts, ZoneInfo(inputs.timezone))
    exceeded = limit_candidates(session, inputs.building_id)
    reconcile(session, inputs.building_id, (*exceeded, *changes), "events", now)
    session.flush()
    write_messages(session, inputs.building_id, inputs.message_age, now)


def _update(
    session: Session, claim: Claim, building_id: int, pairs: Sequence[tuple[SeriesInputs, Monitoring]], now: datetime
) -> None:
    """Write what changed since the building was monitored last; unchanged values and alarms are left alone."""
    of_building = select(MonitoredSeries).where(MonitoredSeries.building_id == building_id)
    stored = {
        (one.quantity, one.subject): one
        for one in session.scalars(of_building.options(selectinload(MonitoredSeries.alarms)))
    }
    rows = []
    for series_inputs, monitored in pairs:
        name = {"quantity": monitored.series.quantity, "subject": monitored.series.subject}
        row = stored.pop((name["quantity"], name["subject"]), None)
        row = row or MonitoredSeries(building_id=building_id, alarms=[], **name)
        row.job_id, row.created_at, row.version = claim.job_id, now, VERSION
        row.reference_id, row.wanted = series_inputs.reference_id, monitored.events_needed
        row.baseline = None if monitored.baseline is None else written(monitored.baseline)
        session.add(row)
        rows.append((row, monitored))
    session.flush()  # new series have their numbers
    _update_values(
        session, building_id, {(row.id, one.event): _value(one) for row, monitored in rows for one in monitored.values}
    )
    for row, monitored in rows:
        _update_alarms(session, row, monitored.alarms)
    for row in stored.values():
        _delete(session, row.alarms)
        session.delete(row)


def _update_values(session: Session, building_id: int, values: Mapping[tuple[int, int], Mapping[str, Any]]) -> None:
    """Bring the stored values in line, in one statement each for new, changed and superseded ones.

    Args:
        session: of the transaction.
        building_id: of the building.
        values: columns of every value by series and event.
    """
    table = DriftValue.__table__
    of_building = select(table).join(MonitoredSeries, MonitoredSeries.id == table.c.series_id)
    lines = session.execute(of_building.where(MonitoredSeries.building_id == building_id)).mappings()
    stored = {(line["series_id"], line["event_id"]): line for line in lines}
    new = [
        {"series_id": series, "event_id": event, **columns}
        for (series, event), columns in values.items()
        if (series, event) not in stored
    ]
    changed = [
        {"id": stored[key]["id"], **columns}
        for key, columns in values.items()
        if key in stored and any(stored[key][name] != content for name, content in columns.items())
    ]
    superseded = [{"number": line["id"]} for key, line in stored.items() if key not in values]
    if new:
        session.execute(insert(DriftValue), new)
    if changed:
        session.execute(update(DriftValue), changed)
    if superseded:
        session.connection().execute(delete(DriftValue).where(DriftValue.id == bindparam("number")), superseded)


def _update_alarms(session: Session, row: MonitoredSeries, alarms: Sequence[Alarm]) -> None:
    """Keep the stored alarms unless one differs: their numbers keep the order in which they were raised."""
    current = [_alarm(alarm) for alarm in alarms]
    if current != [{name: getattr(alarm, name) for name in ALARM} for alarm in row.alarms]:
        _delete(session, row.alarms)
        row.alarms = [DriftAlarm(**columns) for columns in current]


def _delete(session: Session, rows: Iterable[DriftAlarm]) -> None:
    for row in list(rows):
        session.delete(row)


def _is_overtaken(session: Session, claim: Claim, building_id: int) -> bool:
    """True if a later job does the same with newer data; a failed one does not."""
    later = (Job.kind == WATCH, Job.building_id == building_id, Job.id > claim.job_id, Job.state != "failed")
    return session.scalar(select(Job.id).where(*later).limit(1)) is not None


def _series_inputs(
    series: Series,
    channels: tuple[str, ...],
    findings: Mapping[int, Sequence[Finding]],
    period: ReferencePeriod | None,
    ageing: Ageing | None,
    earlier: Baseline | None,
) -> SeriesInputs:
    notes = sensor_notes(findings, channels)
    period_id = None if period is None else period.id
    return SeriesInputs(series, reference(period), notes, period_id, channels, ageing, earlier)


def _fitted(session: Session, building_id: int) -> Mapping[tuple[str, str], Baseline]:
    """Baselines that this version of the code fitted, by quantity and subject."""
    query = select(MonitoredSeries.quantity, MonitoredSeries.subject, MonitoredSeries.baseline)
    rows = session.execute(query.where(MonitoredSeries.building_id == building_id, MonitoredSeries.version == VERSION))
    return {(row.quantity, row.subject): read(row.baseline) for row in rows if row.baseline is not None}


def _pooled(own: Sequence[tuple[SeriesInputs, Monitoring]]) -> Iterator[tuple[SeriesInputs, Monitoring]]:
    """The mean of both directions, for each quantity of the layer measured in both."""
    known = {
        (monitored.series.quantity, monitored.series.subject): (series_inputs, monitored)
        for series_inputs, monitored in own
    }
    for quantity in LAYER_QUANTITIES:
        if (quantity, "x") in known and (quantity, "y") in known:
            (x, of_x), (y, of_y) = known[quantity, "x"], known[quantity, "y"]
            monitored = pooled(of_x, of_y, BOTH_DIRECTIONS)
            yield SeriesInputs(monitored.series, x.reference, {}, x.reference_id, (*x.channels, *y.channels)), monitored


def _value(value: EventValue) -> dict[str, Any]:
    """Columns of an event's value."""
    return {
        "value": value.value,
        "std": value.std,
        "count": value.count,
        "is_reference": value.is_reference,
        "is_beyond": value.is_out_of_range,
        "is_excluded": value.is_excluded,
        "causes": list(value.causes),
    }


ALARM = {
    "rule": "rule",
    "is_sure": "is_sure",
    "onset_event_id": "onset",
    "after_event_id": "after",
    "by_event_id": "by",
    "raised_event_id": "raised",
    "event_ids": "events",
    "drift": "drift",
    "low": "low",
    "high": "high",
    "false_alarms": "false_alarms",
    "causes": "causes",
    "message": "message",
}
"""Attributes of an alarm by column."""


def _alarm(alarm: Alarm) -> dict[str, Any]:
    """Columns of an alarm, with lists as JSON has them."""
    columns = {column: getattr(alarm, attribute) for column, attribute in ALARM.items()}
    return columns | {"event_ids": list(alarm.events), "causes": list(alarm.causes)}
