"""Periodic checks of every building: data health, new messages and reminders, whether records arrive or not."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

from sqlalchemy.orm import Session, sessionmaker

from service.alerts import building_states, checked_buildings, data_health, queries
from service.alerts.building_states import BuildingState
from service.alerts.candidates import KINDS, AlertCandidate
from service.alerts.checked_buildings import Checked, Known
from service.alerts.data_health import Source, Thresholds, Work
from service.alerts.messages import next_reminder, remind, write_messages
from service.alerts.reconciliation import is_reconciled, reconcile
from service.buildings import store as building_store
from service.buildings.locking import locked
from service.buildings.tables import Building
from service.db.sessions import free_bytes, reading
from service.jobs import queue as job_queue
from service.settings import Settings
from service.verdict import levels

NO_WORK = Work(oldest=None, last_progress=None)
"""Work of a building without a neglected job."""
FULL_CHECK, SPREAD = timedelta(hours=6), 100
"""Least time after which an unchanged building is checked in full all the same, at up to so many times until twice it.
"""


@dataclass(frozen=True, slots=True)
class Round:
    """Inputs of one round of checks that are the same for all buildings."""

    settings: Settings
    thresholds: Thresholds
    work: Mapping[int, Work]
    """Neglected work, by building."""
    free: int | None
    """Bytes on the disk of the database; None for a server."""
    now: datetime


def check_buildings(
    sessions: sessionmaker[Session],
    settings: Settings,
    now: datetime,
    stopped: Callable[[], bool] = lambda: False,
    last: dict[int, Checked] | None = None,
) -> None:
    """Check the data health of every building, write the messages and reminders that are due, and store the levels.

    All buildings are read together; an unchanged one takes no statement of its own, after a start of the poller too.

    Args:
        sessions: of the database.
        settings: of the service.
        now: aware time.
        stopped: checked before each building; the others are left to the next call.
        last: each building at its last check, updated; empty at a start, and then read from the database.
    """
    last = {} if last is None else last
    with reading(sessions)() as session:
        states = building_states.read(session, _rejected_age(settings), now)
        this = Round(settings, _thresholds(settings), _work(session, settings, now), free_bytes(session), now)
        if not last:
            last.update(checked_buildings.read(session, states, settings))
    changed: dict[int, Checked] = {}
    for building_id, state in states.items():
        before = last.get(building_id)
        if before is not None and _is_idle(building_id, state, before, this):
            continue
        if stopped():
            break
        changed[building_id] = last[building_id] = _check(sessions, building_id, before, this)
        if len(changed) == levels.TOGETHER:
            _store(sessions, changed, this)
            changed = {}
    _store(sessions, changed, this)


def _store(sessions: sessionmaker[Session], checks: Mapping[int, Checked], this: Round) -> None:
    """Store the levels of the checked buildings, and what their checks found."""
    if checks:
        with sessions.begin() as session:
            levels.store(session, checks, this.now)
            checked_buildings.store(session, checks, this.settings)


def _is_idle(building_id: int, state: BuildingState, before: Checked, this: Round) -> bool:
    """True if the building is the same as at its last check, and the time that has passed changes nothing."""
    return (
        before.is_settled
        and before.checked_at <= this.now < before.expires_at
        and state.events == before.state.events
        and state.news == before.state.news
        and _candidates(building_id, state, before.known, before.began, this) == before.candidates
    )


def _check(sessions: sessionmaker[Session], building_id: int, before: Checked | None, this: Round) -> Checked:
    """Check one building as it is now, and write what is due."""
    with reading(sessions)() as session:
        checked = _checked(session, building_id, before, this)
    if not checked.is_settled:
        with sessions.begin() as session:
            locked(session, building_id)
            reconcile(session, building_id, checked.candidates, "clock", this.now)
            session.flush()
            write_messages(session, building_id, timedelta(seconds=this.settings.notify.max_event_age), this.now)
            remind(session, building_id, _reminder_interval(this.settings), this.now)
    return checked


def _checked(session: Session, building_id: int, before: Checked | None, this: Round) -> Checked:
    state = building_states.read(session, _rejected_age(this.settings), this.now, building_id)[building_id]
    is_known = before is not None and before.state.events == state.events
    known = before.known if before is not None and is_known else _known(session, building_id, this.thresholds)
    began = {one.cause: one.began_at for one in queries.open_alerts(session, building_id, KINDS["clock"])}
    candidates = _candidates(building_id, state, known, began, this)
    reminder = next_reminder(session, building_id, _reminder_interval(this.settings), this.now)
    is_settled = (
        before is not None
        and is_known
        and before.checked_at <= this.now < before.expires_at
        and before.state.news == state.news
        and is_reconciled(session, building_id, candidates, "clock")
        and (reminder is None or reminder.due_at > this.now)
    )
    expires_at = this.now + FULL_CHECK * (1 + building_id % SPREAD / SPREAD)
    if reminder is not None:
        expires_at = min(expires_at, reminder.due_at)
    return Checked(this.now, state, known, began, candidates, expires_at, is_settled)


def _reminder_interval(settings: Settings) -> timedelta:
    return timedelta(seconds=settings.notify.reminder_interval)


def _rejected_age(settings: Settings) -> timedelta:
    return timedelta(seconds=settings.data_health.rejected_age)


def _candidates(
    building_id: int, state: BuildingState, known: Known, began: Mapping[str, datetime], this: Round
) -> tuple[AlertCandidate, ...]:
    """Candidates of all periodic checks; what continues keeps the time at which it began."""
    candidates: list[AlertCandidate] = []
    if known.has_source:
        source = _source(state, known)
        candidates += data_health.stopped_source(source, this.thresholds, this.now)
        candidates += data_health.stopped_records(source, this.thresholds, this.now)
        candidates += data_health.wrong_clocks(source, this.thresholds)
    if state.rejected is not None:
        candidates += data_health.rejected_files(state.rejected)
    streamed = state.silent.keys() if known.streamed is None else known.streamed
    silent = {channel: since for channel, since in state.silent.items() if channel in streamed}
    now_silent = tuple(data_health.silent_channels(silent, this.thresholds, this.now))
    candidates += now_silent
    causes = {one.cause for one in now_silent}
    candidates += [one for one in known.dead_channels if one.cause not in causes]
    candidates += data_health.stuck_work(this.work.get(building_id, NO_WORK), this.thresholds, this.now)
    if this.free is not None:
        candidates += data_health.full_disk(this.free, this.thresholds, began.get("disk"), this.now)
    return tuple(replace(one, began_at=min(one.began_at, began.get(one.cause, one.began_at))) for one in candidates)


def _source(state: BuildingState, known: Known) -> Source:
    attempted_at, succeeded_at, failing_since, error, clock_ahead = state.poll or (None,) * 5
    end, received_at = state.last_record or (None, None)
    return Source(
        is_continuous=known.is_continuous,
        watched_since=state.created_at,
        described_at=known.described_at,
        attempted_at=attempted_at,
        succeeded_at=succeeded_at,
        failing_since=failing_since,
        error=error,
        last_record=end,
        ahead=timedelta(0) if end is None or received_at is None else end - received_at,
        came_at=received_at,
        server_ahead=None if clock_ahead is None else timedelta(seconds=clock_ahead),
    )


def _known(session: Session, building_id: int, thresholds: Thresholds) -> Known:
    building = session.get_one(Building, building_id)
    revision = building_store.current(session, building)
    described = building_store.parsed(revision)
    channels = [channel.id for channel in described.description.channels]
    sightings = building_states.sightings(session, building_id)
    seen = building_states.channels_ever(session, building_id)
    return Known(
        has_source=described.source is not None,
        is_continuous=described.source is not None and described.source.data == "continuous",
        described_at=revision.created_at,
        dead_channels=tuple(data_health.dead_channels(sightings, channels, seen, thresholds)),
        streamed=frozenset(channels if described.source is not None and described.source.kind == "seedlink" else ()),
    )


def _thresholds(settings: Settings) -> Thresholds:
    return Thresholds(
        source=timedelta(seconds=settings.data_health.source_timeout),
        continuous=timedelta(seconds=settings.data_health.continuous_timeout),
        quiet=timedelta(seconds=settings.data_health.event_silence_timeout),
        misses=settings.data_health.channel_misses,
        clock=timedelta(seconds=settings.data_health.clock_tolerance),
        worker=timedelta(seconds=settings.data_health.worker_timeout),
        reserve=settings.data_health.disk_reserve,
    )


def _work(session: Session, settings: Settings, now: datetime) -> dict[int, Work]:
    """Neglected work by building: read once for all of them."""
    lease, patience = timedelta(seconds=settings.jobs.lease), timedelta(seconds=settings.data_health.worker_timeout)
    oldest = job_queue.neglected_since(session, now, lease)
    late = {building_id: since for building_id, since in oldest.items() if now - since > patience}
    progress = job_queue.last_progress(session, now, lease) if late else None
    return {
        building_id: Work(oldest=since, last_progress=progress if building_id in late else None)
        for building_id, since in oldest.items()
    }
