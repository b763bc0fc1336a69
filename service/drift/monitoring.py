"""Monitoring of a building for drift: inputs read from the database, one computation, and results written back.

One more earthquake costs what is new: the state that the last monitoring left (`service.drift.state`) has what is
needed of the others.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from types import MappingProxyType
from typing import Any
from zoneinfo import ZoneInfo

import numpy as np
from sqlalchemy import bindparam, delete, insert, or_, select, update
from sqlalchemy.orm import Session, selectinload

from core.arrays import Indices
from core.drift.ageing import Ageing, ageing_of
from core.drift.alarms import Alarm
from core.drift.baseline import Baseline
from core.drift.deviations import EventNotes, EventValue
from core.drift.from_analyses import channels_of, sensor_notes
from core.drift.monitor import EventValues, Judged, Monitoring, Reference, SeriesState, is_after, monitor
from core.drift.pooled import PooledValues, pooled
from core.drift.quantities import BOTH_DIRECTIONS, LAYER_QUANTITIES, QUANTITIES, SENSOR_QUANTITIES
from core.drift.series import Series
from core.record import Finding
from service.alerts.messages import write_messages
from service.alerts.reconciliation import reconcile
from service.analyses import history
from service.analyses.mode_tracks import DIRECTIONS
from service.buildings.locking import locked
from service.buildings.reference_periods import in_force, reference
from service.buildings.store import described
from service.buildings.tables import Building
from service.drift.alert_candidates import drift_candidates, limit_candidates
from service.drift.baseline import read, written
from service.drift.frequencies import Sightings, followed, frequencies
from service.drift.series import CYCLE_QUANTITIES, monitored_series
from service.drift.state import BuildingState, Name, decoded, encoded, facts
from service.drift.tables import DriftAlarm, DriftState, DriftValue, MonitoredSeries, ReferencePeriod
from service.jobs.queue import WATCH, Claim
from service.jobs.stages import Stage
from service.jobs.tables import Job
from service.settings import Settings
from service.version import VERSION

FREQUENCY = "frequency"
GOING_ON = CYCLE_QUANTITIES | SENSOR_QUANTITIES | {"residual_displacement"}
"""Quantities whose series go on from their state with the measurements of changed events alone."""
CHANGED_AT_MOST = 100
"""Events that changed since the last monitoring up to which it goes on from its state: statements list them.
A choice."""


@dataclass(frozen=True, slots=True)
class SeriesInputs:
    """One series with everything that its monitoring needs."""

    series: Series
    """All measurements, or those of the events that changed since `before`."""
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
    before: SeriesState | None = None
    """State that the last monitoring left."""
    omitted: tuple[int, ...] = ()
    """Events whose measurements are not in the series, because `before` has what is needed of them."""


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
    analyses: Mapping[int, tuple[int, float]]
    """As in `BuildingState`."""
    changed: frozenset[int]
    """Events that were analysed since the last monitoring, or are gone; all where nothing is known of that."""
    facts: str
    """As in `DriftState`."""
    modes: Mapping[str, Sightings]
    """By direction."""
    judged: Mapping[Name, Judged]
    """As in `BuildingState`, as the last monitoring left it."""


def inputs(session: Session, claim: Claim, settings: Settings) -> MonitoringInputs:
    """The monitored series of a claimed job's building, as stored now."""
    building = session.get_one(Building, claim.building_id)
    file = described(session, building)
    events = history.analysed_events(session, building.id)
    analyses = {row.event: (row.analysis, row.event_start.timestamp()) for row in events}
    noted = {row.event: [Finding(**one) for one in row.quality] for row in events if row.quality}
    periods = history.reference_periods(session, building.id)
    ageing = ageing_of(file.description.isolation.rubber, file.description.isolation.installed)
    fitted = _fitted(session, building.id)
    of_state = facts(building.revisions[-1].id, [one.id for one in periods])
    state = _state(session, building.id, of_state)
    changed = frozenset(event for event, _ in analyses.items() ^ (set() if state is None else state.analyses.items()))
    going_on = state if state is not None and _goes_on(state, analyses, changed, fitted, periods) else None
    modes = _modes(session, building.id, going_on, changed)
    series_inputs = []
    for series, is_whole in _measured(session, building.id, going_on, changed, modes):
        name = (series.quantity, series.subject)
        channels, period = channels_of(series, file.description), in_force(periods, *name)
        series_inputs.append(
            SeriesInputs(
                series=series,
                reference=reference(period),
                notes=sensor_notes(noted, channels),
                reference_id=None if period is None else period.id,
                channels=channels,
                ageing=ageing,
                earlier=fitted.get(name),
                before=None if state is None else state.series.get(name),
                omitted=() if is_whole else tuple(analyses.keys() - changed),
            )
        )
    return MonitoringInputs(
        building_id=building.id,
        series_inputs=tuple(series_inputs),
        starts={row.event: row.event_start for row in events},
        timezone=file.timezone,
        message_age=timedelta(seconds=settings.notify.max_event_age),
        analyses=analyses,
        changed=changed,
        facts=of_state,
        modes=modes,
        judged={} if state is None else state.judged,
    )


def stages(inputs: MonitoringInputs) -> Sequence[Stage]:
    """All series at once: each takes a fraction of a second."""
    return (Stage("Looking for drift", monitored, lambda _, report_step: (inputs.series_inputs, inputs.judged)),)


def monitored(
    series_inputs: Sequence[SeriesInputs], judged: Mapping[Name, Judged] = MappingProxyType({})
) -> tuple[tuple[SeriesInputs, Monitoring], ...]:
    """Baseline, values and alarms of each series, then of the mean of both directions of the layer."""
    own = [
        (
            replace(one, before=None, omitted=()),
            monitor(one.series, one.reference, one.notes, one.ageing, one.earlier, one.before, one.omitted),
        )
        for one in series_inputs
    ]
    return (*own, *_pooled(own, judged))


def store(
    session: Session,
    claim: Claim,
    inputs: MonitoringInputs,
    results: Sequence[Sequence[tuple[SeriesInputs, Monitoring]]],
    now: datetime,
) -> None:
    """Bring the building's drift up to date and notify its recipients, unless a later job will."""
    locked(session, inputs.building_id)
    if _is_overtaken(session, claim, inputs.building_id):
        return
    pairs = results[-1]
    _update(session, claim, inputs, pairs, now)
    monitorings = [(monitored, series_inputs.channels) for series_inputs, monitored in pairs]
    changes = drift_candidates(monitorings, inputs.starts, ZoneInfo(inputs.timezone))
    exceeded = limit_candidates(session, inputs.building_id)
    reconcile(session, inputs.building_id, (*exceeded, *changes), "events", now)
    session.flush()
    write_messages(session, inputs.building_id, inputs.message_age, now)


def _update(
    session: Session,
    claim: Claim,
    inputs: MonitoringInputs,
    pairs: Sequence[tuple[SeriesInputs, Monitoring]],
    now: datetime,
) -> None:
    """Write what changed since the building was monitored last; unchanged values and alarms are left alone."""
    of_building = select(MonitoredSeries).where(MonitoredSeries.building_id == inputs.building_id)
    stored = {
        (one.quantity, one.subject): one
        for one in session.scalars(of_building.options(selectinload(MonitoredSeries.alarms)))
    }
    rows = []
    for series_inputs, monitored in pairs:
        name = {"quantity": monitored.series.quantity, "subject": monitored.series.subject}
        row = stored.pop((name["quantity"], name["subject"]), None)
        row = row or MonitoredSeries(building_id=inputs.building_id, alarms=[], **name)
        row.job_id, row.created_at, row.version = claim.job_id, now, VERSION
        row.reference_id, row.wanted = series_inputs.reference_id, monitored.events_needed
        row.baseline = None if monitored.baseline is None else written(monitored.baseline)
        session.add(row)
        rows.append((row, monitored))
    session.flush()  # new series have their numbers
    _update_values(session, {row.id: monitored for row, monitored in rows}, inputs.changed)
    for row, monitored in rows:
        _update_alarms(session, row, monitored.alarms)
    for row in stored.values():
        _delete(session, row.alarms)
        session.execute(delete(DriftValue).where(DriftValue.series_id == row.id))
        session.delete(row)
    content = encoded(_left(inputs, [monitored for _, monitored in pairs]))
    session.merge(DriftState(building_id=inputs.building_id, created_at=now, facts=inputs.facts, content=content))


def _left(inputs: MonitoringInputs, monitorings: Sequence[Monitoring]) -> BuildingState:
    """State for the next monitoring."""
    named = {(one.series.quantity, one.series.subject): one for one in monitorings}
    own = {name: one for name, one in named.items() if name[1] != BOTH_DIRECTIONS}
    return BuildingState(
        analyses=inputs.analyses,
        series={name: one.state for name, one in own.items() if one.state is not None},
        judged={name: one.judged for name, one in named.items() if name not in own and one.judged is not None},
        others=frozenset(quantity for (quantity, _), one in own.items() if one.state is None),
        modes=inputs.modes,
    )


def _update_values(session: Session, monitorings: Mapping[int, Monitoring], changed: Collection[int]) -> None:
    """Bring the stored values in line, in one statement each for new, changed and superseded ones.

    Only the values of series without any from before, of changed events, and of events after these are compared.

    Args:
        session: of the transaction.
        monitorings: by number of the series.
        changed: numbers of the events that were analysed since the last monitoring, or are gone.
    """
    events = {series: _events(one).tolist() for series, one in monitorings.items()}
    values = {
        (series, event): _value(one.values[place])
        for series, one in monitorings.items()
        for place, event in enumerate(events[series])
        if place >= one.unchanged or event in changed
    }
    table = DriftValue.__table__
    whole = [series for series, one in monitorings.items() if not one.unchanged]
    touched = {*changed, *(event for series, event in values if monitorings[series].unchanged)}
    is_compared = or_(table.c.series_id.in_(whole), table.c.event_id.in_(touched))
    query = select(table).where(table.c.series_id.in_(events), is_compared)
    stored = {(line["series_id"], line["event_id"]): line for line in session.execute(query).mappings()}
    new = [
        {"series_id": series, "event_id": event, **columns}
        for (series, event), columns in values.items()
        if (series, event) not in stored
    ]
    different = [
        {"id": stored[key]["id"], **columns}
        for key, columns in values.items()
        if key in stored and any(stored[key][name] != content for name, content in columns.items())
    ]
    present = {series: set(own) for series, own in events.items()}
    superseded = [{"number": line["id"]} for (series, event), line in stored.items() if event not in present[series]]
    if new:
        session.execute(insert(DriftValue), new)
    if different:
        session.execute(update(DriftValue), different)
    if superseded:
        session.connection().execute(delete(DriftValue).where(DriftValue.id == bindparam("number")), superseded)


def _events(monitoring: Monitoring) -> Indices:
    """(n,) numbers of the events of its values."""
    values = monitoring.values
    return values.events if isinstance(values, EventValues | PooledValues) else np.arange(0)


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


def _state(session: Session, building_id: int, of_state: str) -> BuildingState | None:
    """State that the last monitoring left; None where it does not hold any more."""
    holds = (DriftState.building_id == building_id, DriftState.facts == of_state)
    content = session.scalar(select(DriftState.content).where(*holds))
    return None if content is None else decoded(content)


def _goes_on(
    state: BuildingState,
    analyses: Mapping[int, tuple[int, float]],
    changed: Collection[int],
    fitted: Mapping[Name, Baseline],
    periods: Sequence[ReferencePeriod],
) -> bool:
    """True if the measurements of the changed events are enough: they leave every baseline as it is."""
    if len(changed) > CHANGED_AT_MOST:
        return False
    starts = [of[event][1] for of in (analyses, state.analyses) for event in changed if event in of]
    first = datetime.fromtimestamp(min(starts), UTC) if starts else datetime.max.replace(tzinfo=UTC)
    for name, one in state.series.items():
        baseline = fitted.get(name)
        if name[0] not in GOING_ON:
            continue
        if baseline is None or baseline.inputs != one.inputs:
            return False
        of_reference = one.summaries.time[np.isin(one.summaries.event, baseline.events)]
        last = datetime.fromtimestamp(float(of_reference.max()), UTC)
        if not is_after(first, baseline, last, reference(in_force(periods, *name))):
            return False
    return True


def _modes(
    session: Session, building_id: int, state: BuildingState | None, changed: Collection[int]
) -> Mapping[str, Sightings]:
    """Modes of each direction."""
    before = {} if state is None else state.modes
    return {name: followed(session, building_id, name, before.get(name), changed) for name in DIRECTIONS}


def _measured(
    session: Session,
    building_id: int,
    state: BuildingState | None,
    changed: Collection[int],
    modes: Mapping[str, Sightings],
) -> Iterator[tuple[Series, bool]]:
    """Every series of a building by quantity and subject, and whether it has the measurements of all events."""
    going_on = frozenset() if state is None else GOING_ON - state.others
    whole = list(monitored_series(session, building_id, QUANTITIES.keys() - going_on - {FREQUENCY}))
    temperatures = dict(history.temperatures(session, building_id))
    for direction, sightings in modes.items():
        whole += frequencies(direction, sightings, temperatures)
    found = {(one.quantity, one.subject): (one, True) for one in whole}
    if state is not None:
        found |= {name: (Series(*name, ()), False) for name in state.series if name[0] in going_on}
        for one in monitored_series(session, building_id, going_on, changed):
            name = (one.quantity, one.subject)
            found[name] = (one, name not in state.series)
    yield from (found[name] for name in sorted(found))


def _fitted(session: Session, building_id: int) -> Mapping[tuple[str, str], Baseline]:
    """Baselines that this version of the code fitted, by quantity and subject."""
    query = select(MonitoredSeries.quantity, MonitoredSeries.subject, MonitoredSeries.baseline)
    rows = session.execute(query.where(MonitoredSeries.building_id == building_id, MonitoredSeries.version == VERSION))
    return {(row.quantity, row.subject): read(row.baseline) for row in rows if row.baseline is not None}


def _pooled(
    own: Sequence[tuple[SeriesInputs, Monitoring]], judged: Mapping[Name, Judged]
) -> Iterator[tuple[SeriesInputs, Monitoring]]:
    """The mean of both directions, for each quantity of the layer measured in both."""
    known = {
        (monitored.series.quantity, monitored.series.subject): (series_inputs, monitored)
        for series_inputs, monitored in own
    }
    for quantity in LAYER_QUANTITIES:
        if (quantity, "x") in known and (quantity, "y") in known:
            (x, of_x), (y, of_y) = known[quantity, "x"], known[quantity, "y"]
            monitored = pooled(of_x, of_y, BOTH_DIRECTIONS, judged.get((quantity, BOTH_DIRECTIONS)))
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
