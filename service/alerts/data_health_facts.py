"""What the database and the disk know of data that stopped, at one building?"""

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy.orm import Session

from service.alerts import data_health, queries
from service.alerts.candidates import KINDS, Found
from service.alerts.data_health import Patience, Rejected, Sighting, Source, Work
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building
from service.db.sessions import free_bytes
from service.health import queries as health_queries
from service.records import queries as record_queries
from service.records.tables import SourceState
from service.settings import Settings

LOOKED_AT = 50
"""Of the latest earthquakes, to find since when a channel is dead."""


def found_by_clock(session: Session, building: Building, settings: Settings, now: datetime) -> tuple[Found, ...]:
    """Everything that stopped, as far as it is stored now; what goes on keeps the time at which it began."""
    told = {one.cause: one.began_at for one in queries.open_alerts(session, building.id, KINDS["clock"])}
    every = _stopped(session, building, settings, told.get("disk"), now)
    return tuple(replace(one, began_at=min(one.began_at, told.get(one.cause, one.began_at))) for one in every)


def _stopped(
    session: Session, building: Building, settings: Settings, full_since: datetime | None, now: datetime
) -> Sequence[Found]:
    described, patience = building_store.described(session, building), _patience(settings)
    found: list[Found] = []
    if described.source is not None:
        source = _source(session, building, described)
        found += data_health.stopped_source(source, patience, now)
        found += data_health.stopped_records(source, patience, now)
        found += data_health.wrong_clocks(source, patience)
    found += data_health.rejected_files(_rejected(session, building, settings, now))
    channels = [channel.id for channel in described.description.channels]
    seen = health_queries.channels_ever(session, building.id)
    found += data_health.dead_channels(_sightings(session, building), channels, seen, patience)
    found += data_health.stuck_work(_work(session, building, settings, now), patience, now)
    if (free := free_bytes(session)) is not None:
        found += data_health.full_disk(free, patience, full_since, now)
    return found


def _patience(settings: Settings) -> Patience:
    return Patience(
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
    """Rejected files that count: not too old, and later than the last time that somebody ended the alert."""
    ended = [inspection.at for cause, inspection in queries.inspections(session, building.id) if cause == "rejected"]
    since = max([now - timedelta(seconds=settings.data_health.rejected_age), *ended])
    rows = record_queries.rejected(session, building.id, since)
    return [Rejected(name=row.name, at=row.received_at, reason=(row.reason or "").rstrip(".")) for row in rows]


def _sightings(session: Session, building: Building) -> list[Sighting]:
    """The latest earthquakes, each with its channels but those that screening found dead."""
    rows = health_queries.latest_events(session, building.id, LOOKED_AT)
    numbers = [row.id for row in rows]
    there, files = health_queries.channels_of(session, numbers), health_queries.files_of(session, numbers)
    return [
        Sighting(
            event=row.id,
            start=row.start,
            channels=there.get(row.id, set()) - (dead := _dead(row.quality)).keys(),
            findings=dead,
            files=files.get(row.id, ()),
        )
        for row in rows
    ]


def _dead(quality: Sequence[dict[str, Any]] | None) -> dict[str, str]:
    """What screening says of each channel that it took for dead."""
    return {finding["channel"]: finding["message"] for finding in quality or () if finding["kind"] == "dead"}


def _work(session: Session, building: Building, settings: Settings, now: datetime) -> Work:
    lease = timedelta(seconds=settings.jobs.lease)
    return Work(
        oldest=health_queries.oldest_undone_job(session, building.id, now, lease),
        last_progress=health_queries.last_progress(session, now, lease),
    )
