"""Periodic checks of every building: data health, new messages and reminders, whether records arrive or not."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import data_health, queries
from service.alerts.candidates import KINDS, AlertCandidate
from service.alerts.data_health import Rejected, Sighting, Source, Thresholds, Work
from service.alerts.messages import due_reminder, remind, write_messages
from service.alerts.reconciliation import is_reconciled, reconcile
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building
from service.db.sessions import free_bytes, reading
from service.health import queries as health_queries
from service.jobs import queue as job_queue
from service.records import queries as record_queries
from service.records.tables import SourceState
from service.settings import Settings

NO_WORK = Work(oldest=None, last_progress=None)
"""Work of a building without a neglected job."""
LATEST = 50
"""Latest earthquakes in which dead channels are looked for."""


@dataclass(frozen=True, slots=True)
class Checked:
    """State of a building at its last check: nothing is done again while it is the same."""

    events: tuple[object, ...]
    """Version of its events."""
    dead_channels: tuple[AlertCandidate, ...]
    """By these events."""
    news: tuple[object, ...]
    """Version of everything that its messages report."""


def check_buildings(
    sessions: sessionmaker[Session],
    settings: Settings,
    now: datetime,
    stopped: Callable[[], bool] = lambda: False,
    last: dict[int, Checked] | None = None,
) -> None:
    """Check the data health of every building, and write the messages and reminders that are due.

    Args:
        sessions: of the database.
        settings: of the service.
        now: aware time.
        stopped: checked before each building; the others are left to the next call.
        last: state of each building at its last check, updated; an unchanged building takes a few reading statements.
    """
    last = {} if last is None else last
    with reading(sessions)() as session:
        numbers = session.scalars(select(Building.id).order_by(Building.code)).all()
        work = _work(session, settings, now)
    for building_id in numbers:
        if stopped():
            return
        own = work.get(building_id, NO_WORK)
        with reading(sessions)() as session:
            checked, candidates, is_due = _checked(session, building_id, settings, own, last.get(building_id), now)
        if is_due:
            _write(sessions, building_id, candidates, settings, now)
        last[building_id] = checked


def _checked(
    session: Session, building_id: int, settings: Settings, work: Work, before: Checked | None, now: datetime
) -> tuple[Checked, tuple[AlertCandidate, ...], bool]:
    """The state of a building, its candidates, and True if there may be something to write."""
    building = session.get_one(Building, building_id)
    events = queries.events_version(session, building_id)
    is_same = before is not None and before.events == events
    dead = before.dead_channels if before is not None and is_same else _dead_channels(session, building, settings)
    candidates = _candidates(session, building, settings, work, dead, now)
    is_watched = job_queue.is_monitoring_pending(session, building_id)
    checked = Checked(events, dead, (*events, is_watched, *queries.news_version(session, building_id, now)))
    is_settled = (
        before is not None
        and before.news == checked.news
        and is_reconciled(session, building_id, candidates, "clock")
        and due_reminder(session, building_id, _reminder_interval(settings), now) is None
    )
    return checked, candidates, not is_settled


def _write(
    sessions: sessionmaker[Session],
    building_id: int,
    candidates: Sequence[AlertCandidate],
    settings: Settings,
    now: datetime,
) -> None:
    with sessions.begin() as session:
        reconcile(session, building_id, candidates, "clock", now)
        session.flush()
        write_messages(session, building_id, timedelta(seconds=settings.notify.max_event_age), now)
        remind(session, building_id, _reminder_interval(settings), now)


def _reminder_interval(settings: Settings) -> timedelta:
    return timedelta(seconds=settings.notify.reminder_interval)


def _candidates(
    session: Session,
    building: Building,
    settings: Settings,
    work: Work,
    dead: Sequence[AlertCandidate],
    now: datetime,
) -> tuple[AlertCandidate, ...]:
    """Candidates of all periodic checks; what continues keeps the time at which it began."""
    described, thresholds = building_store.described(session, building), _thresholds(settings)
    began = {one.cause: one.began_at for one in queries.open_alerts(session, building.id, KINDS["clock"])}
    candidates: list[AlertCandidate] = []
    if described.source is not None:
        source = _source(session, building, described)
        candidates += data_health.stopped_source(source, thresholds, now)
        candidates += data_health.stopped_records(source, thresholds, now)
        candidates += data_health.wrong_clocks(source, thresholds)
    candidates += data_health.rejected_files(_rejected(session, building, settings, now))
    candidates += dead
    candidates += data_health.stuck_work(work, thresholds, now)
    if (free := free_bytes(session)) is not None:
        candidates += data_health.full_disk(free, thresholds, began.get("disk"), now)
    return tuple(replace(one, began_at=min(one.began_at, began.get(one.cause, one.began_at))) for one in candidates)


def _dead_channels(session: Session, building: Building, settings: Settings) -> tuple[AlertCandidate, ...]:
    """Candidates of channels that stopped, which change with the building's events only."""
    channels = [channel.id for channel in building_store.described(session, building).description.channels]
    seen = health_queries.channels_ever(session, building.id)
    return tuple(data_health.dead_channels(_sightings(session, building), channels, seen, _thresholds(settings)))


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


def _source(session: Session, building: Building, described: BuildingFile) -> Source:
    state = session.get(SourceState, building.id)
    last = health_queries.last_good_recording(session, building.id)
    return Source(
        is_continuous=described.source is not None and described.source.data == "continuous",
        watched_since=building.created_at,
        described_at=building_store.current(session, building).created_at,
        attempted_at=state.attempted_at if state else None,
        succeeded_at=state.succeeded_at if state else None,
        failing_since=state.failing_since if state else None,
        error=state.error if state else None,
        last_record=last.end if last else None,
        ahead=last.end - last.received_at if last and last.end else timedelta(0),
        came_at=last.received_at if last else None,
        server_ahead=None if state is None or state.clock_ahead is None else timedelta(seconds=state.clock_ahead),
    )


def _rejected(session: Session, building: Building, settings: Settings, now: datetime) -> list[Rejected]:
    """Rejected files that count: not too old, and later than the last inspection of their alert."""
    ended = [inspection.at for cause, inspection in queries.inspections(session, building.id) if cause == "rejected"]
    since = max([now - timedelta(seconds=settings.data_health.rejected_age), *ended])
    rows = record_queries.rejected(session, building.id, since)
    return [Rejected(name=row.name, at=row.received_at, reason=(row.reason or "").rstrip(".")) for row in rows]


def _sightings(session: Session, building: Building) -> list[Sighting]:
    """The latest earthquakes, each with its channels except dead ones."""
    rows = health_queries.latest_events(session, building.id, LATEST)
    numbers = [row.id for row in rows]
    recorded, files = health_queries.channels_of(session, numbers), health_queries.files_of(session, numbers)
    return [
        Sighting(
            event=row.id,
            start=row.start,
            channels=recorded.get(row.id, set()) - (dead := _dead(row.quality)).keys(),
            findings=dead,
            files=files.get(row.id, ()),
        )
        for row in rows
    ]


def _dead(quality: Sequence[dict[str, Any]] | None) -> dict[str, str]:
    """Data quality finding of each dead channel."""
    return {finding["channel"]: finding["message"] for finding in quality or () if finding["kind"] == "dead"}


def _work(session: Session, settings: Settings, now: datetime) -> dict[int, Work]:
    """Neglected work by building: read once for all of them."""
    lease, patience = timedelta(seconds=settings.jobs.lease), timedelta(seconds=settings.data_health.worker_timeout)
    oldest = health_queries.neglected_since(session, now, lease)
    late = {building_id: since for building_id, since in oldest.items() if now - since > patience}
    progress = health_queries.last_progress(session, now, lease) if late else None
    return {
        building_id: Work(oldest=since, last_progress=progress if building_id in late else None)
        for building_id, since in oldest.items()
    }
