"""What monitoring a building for drift is made from, what is computed, and what of it goes back to the database."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from zoneinfo import ZoneInfo

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from core.drift.alarms import Alarm
from core.drift.deviations import EventNotes, EventValue
from core.drift.monitor import Monitoring, Reference, monitor
from core.drift.pooled import BOTH_DIRECTIONS, pooled
from core.drift.quantities import LAYER_QUANTITIES
from core.drift.series import Series
from core.quality import Finding
from service.alerts.event_messages import tell
from service.alerts.reconciling import reconcile
from service.analyses import history
from service.buildings.reference_periods import in_force, reference
from service.buildings.store import described
from service.buildings.tables import Building
from service.drift import baseline_json
from service.drift.findings import findings
from service.drift.limit_findings import limit_findings
from service.drift.series import channels_of, watched_series
from service.drift.tables import DriftAlarm, DriftValue, ReferencePeriod, WatchedSeries
from service.jobs.queue import WATCH, Claim
from service.jobs.stages import Stage
from service.jobs.tables import Job
from service.settings import Settings
from service.version import VERSION

MISSING = "missing"
"""Kind of the finding that a sensor was not recorded (core.sensors.screening)."""


@dataclass(frozen=True, slots=True)
class Watched:
    """One series with all that it is monitored by."""

    series: Series
    reference: Reference
    notes: Mapping[int, EventNotes]
    """By event."""
    reference_id: int | None
    channels: tuple[str, ...]
    """That it is measured with."""


@dataclass(frozen=True, slots=True)
class WatchInputs:
    """All series of a building."""

    building_id: int
    watched: tuple[Watched, ...]
    starts: Mapping[int, datetime]
    """Of every analysed event."""
    timezone: str
    """Of the building."""
    message_age: timedelta
    """How long ago an event may have ended of which people are told."""


def inputs(session: Session, claim: Claim, settings: Settings) -> WatchInputs:
    """What is watched at the building of a claimed job, as it is stored now."""
    building = session.get_one(Building, claim.building_id)
    file = described(session, building)
    events = history.findings(session, building.id)
    noted = {row.event: [Finding(**one) for one in row.quality] for row in events}
    periods = history.reference_periods(session, building.id)
    watched = [
        _watched(
            series, channels_of(series, file.description), noted, in_force(periods, series.quantity, series.subject)
        )
        for series in watched_series(session, building.id)
    ]
    return WatchInputs(
        building_id=building.id,
        watched=tuple(watched),
        starts={row.event: row.event_start for row in events},
        timezone=file.timezone,
        message_age=timedelta(seconds=settings.notify.max_event_age),
    )


def stages(inputs: WatchInputs) -> Sequence[Stage]:
    """All series at once: each takes a fraction of a second."""
    return (Stage("Looking for drift", monitored, lambda _, tell: (inputs.watched,)),)


def monitored(watched: Sequence[Watched]) -> tuple[tuple[Watched, Monitoring], ...]:
    """Baseline, values and alarms of each series; then of what both directions of the layer tell together."""
    own = [(one, monitor(one.series, one.reference, one.notes)) for one in watched]
    return (*own, *_pooled(own))


def store(
    session: Session,
    claim: Claim,
    inputs: WatchInputs,
    results: Sequence[Sequence[tuple[Watched, Monitoring]]],
    now: datetime,
) -> None:
    """Put what was found in the place of the building's earlier rows, and tell people, unless a later job sees more."""
    if _is_overtaken(session, claim, inputs.building_id):
        return
    forget(session, inputs.building_id)
    pairs = results[-1]
    session.add_all(_series(watched, found, inputs.building_id, claim.job_id, now) for watched, found in pairs)
    told = [(found, watched.channels) for watched, found in pairs]
    found = findings(told, inputs.starts, ZoneInfo(inputs.timezone))
    exceeded = limit_findings(session, inputs.building_id)
    reconcile(session, inputs.building_id, (*exceeded, *found), "events", now)
    session.flush()
    tell(session, inputs.building_id, inputs.message_age, now)


def forget(session: Session, building_id: int) -> None:
    """Remove the drift rows of a building; all of them can be computed again."""
    own = select(WatchedSeries.id).where(WatchedSeries.building_id == building_id)
    session.execute(delete(DriftAlarm).where(DriftAlarm.series_id.in_(own)))
    session.execute(delete(DriftValue).where(DriftValue.series_id.in_(own)))
    session.execute(delete(WatchedSeries).where(WatchedSeries.building_id == building_id))


def _is_overtaken(session: Session, claim: Claim, building_id: int) -> bool:
    """Whether a later job does the same with what is stored by then; one that was given up does nothing."""
    later = (Job.kind == WATCH, Job.building_id == building_id, Job.id > claim.job_id, Job.state != "failed")
    return session.scalar(select(Job.id).where(*later).limit(1)) is not None


def _watched(
    series: Series,
    channels: tuple[str, ...],
    findings: Mapping[int, Sequence[Finding]],
    period: ReferencePeriod | None,
) -> Watched:
    """With what was found of the sensors that the series is measured with.

    A sensor that an event does not have took no part in it: one that is gone for years does not blind us for years.
    """
    own = {
        event: tuple(one for one in found if one.channel in channels and one.kind != MISSING)
        for event, found in findings.items()
    }
    notes = {event: EventNotes(found) for event, found in own.items() if found}
    return Watched(series, reference(period), notes, None if period is None else period.id, channels)


def _pooled(own: Sequence[tuple[Watched, Monitoring]]) -> Iterator[tuple[Watched, Monitoring]]:
    """The mean of both directions, of each quantity of the layer that both have."""
    known = {(found.series.quantity, found.series.subject): (watched, found) for watched, found in own}
    for quantity in LAYER_QUANTITIES:
        if (quantity, "x") in known and (quantity, "y") in known:
            (x, of_x), (y, of_y) = known[quantity, "x"], known[quantity, "y"]
            found = pooled(of_x, of_y, BOTH_DIRECTIONS)
            yield Watched(found.series, x.reference, {}, x.reference_id, (*x.channels, *y.channels)), found


def _series(watched: Watched, found: Monitoring, building_id: int, job_id: int, now: datetime) -> WatchedSeries:
    return WatchedSeries(
        building_id=building_id,
        job_id=job_id,
        created_at=now,
        version=VERSION,
        quantity=found.series.quantity,
        subject=found.series.subject,
        reference_id=watched.reference_id,
        wanted=found.events_needed,
        baseline=None if found.baseline is None else baseline_json.written(found.baseline),
        values=[_value(value) for value in found.values],
        alarms=[_alarm(alarm) for alarm in found.alarms],
    )


def _value(value: EventValue) -> DriftValue:
    return DriftValue(
        event_id=value.event,
        value=value.value,
        std=value.std,
        count=value.count,
        is_reference=value.is_reference,
        is_beyond=value.is_out_of_range,
        is_excluded=value.is_excluded,
        causes=list(value.causes),
    )


def _alarm(alarm: Alarm) -> DriftAlarm:
    return DriftAlarm(
        rule=alarm.rule,
        is_sure=alarm.is_sure,
        onset_event_id=alarm.onset,
        after_event_id=alarm.after,
        by_event_id=alarm.by,
        raised_event_id=alarm.raised,
        event_ids=list(alarm.events),
        drift=alarm.drift,
        low=alarm.low,
        high=alarm.high,
        false_alarms=alarm.false_alarms,
        causes=list(alarm.causes),
        message=alarm.message,
    )
