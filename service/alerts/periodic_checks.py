"""Periodic checks of every building: data health, new messages and reminders, whether records arrive or not."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import data_health, queries
from service.alerts.candidates import KINDS, AlertCandidate
from service.alerts.data_health import Rejected, Sighting, Source, Thresholds, Work
from service.alerts.messages import remind, write_messages
from service.alerts.reconciliation import reconcile
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building
from service.db.sessions import free_bytes, reading
from service.health import queries as health_queries
from service.records import queries as record_queries
from service.records.tables import SourceState
from service.settings import Settings

LATEST = 50
"""Latest earthquakes in which dead channels are looked for."""


def check_buildings(
    sessions: sessionmaker[Session], settings: Settings, now: datetime, stopped: Callable[[], bool] = lambda: False
) -> None:
    """Check the data health of every building, and write the messages and reminders that are due.

    Args:
        sessions: of the database.
        settings: of the service.
        now: aware time.
        stopped: checked before each building; the others are left to the next call.
    """
    max_age = timedelta(seconds=settings.notify.max_event_age)
    with reading(sessions)() as session:
        numbers = session.scalars(select(Building.id).order_by(Building.code)).all()
    for building_id in numbers:
        if stopped():
            return
        with reading(sessions)() as session:
            candidates = data_health_candidates(session, session.get_one(Building, building_id), settings, now)
        with sessions.begin() as session:
            reconcile(session, building_id, candidates, "clock", now)
            session.flush()
            write_messages(session, building_id, max_age, now)
            remind(session, building_id, timedelta(seconds=settings.notify.reminder_interval), now)


def data_health_candidates(
    session: Session, building: Building, settings: Settings, now: datetime
) -> tuple[AlertCandidate, ...]:
    """Candidates of all periodic checks; what continues keeps the time at which it began."""
    began = {one.cause: one.began_at for one in queries.open_alerts(session, building.id, KINDS["clock"])}
    candidates = _candidates(session, building, settings, began.get("disk"), now)
    return tuple(replace(one, began_at=min(one.began_at, began.get(one.cause, one.began_at))) for one in candidates)


def _candidates(
    session: Session, building: Building, settings: Settings, full_since: datetime | None, now: datetime
) -> Sequence[AlertCandidate]:
    described, thresholds = building_store.described(session, building), _thresholds(settings)
    candidates: list[AlertCandidate] = []
    if described.source is not None:
        source = _source(session, building, described)
        candidates += data_health.stopped_source(source, thresholds, now)
        candidates += data_health.stopped_records(source, thresholds, now)
        candidates += data_health.wrong_clocks(source, thresholds)
    candidates += data_health.rejected_files(_rejected(session, building, settings, now))
    channels = [channel.id for channel in described.description.channels]
    seen = health_queries.channels_ever(session, building.id)
    candidates += data_health.dead_channels(_sightings(session, building), channels, seen, thresholds)
    candidates += data_health.stuck_work(_work(session, building, settings, now), thresholds, now)
    if (free := free_bytes(session)) is not None:
        candidates += data_health.full_disk(free, thresholds, full_since, now)
    return candidates


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


def _work(session: Session, building: Building, settings: Settings, now: datetime) -> Work:
    lease = timedelta(seconds=settings.jobs.lease)
    return Work(
        oldest=health_queries.oldest_undone_job(session, building.id, now, lease),
        last_progress=health_queries.last_progress(session, now, lease),
    )
