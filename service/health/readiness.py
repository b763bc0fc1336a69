"""Readiness of the service: sources are polled, analyses are done, and results can be stored.

Live processes prove nothing: a changed clock, a full disk or blocked threads stop the work while all processes live.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import exists, func, select
from sqlalchemy.orm import Session

from service.alerts.tables import Alert
from service.buildings import queries as building_queries, store as building_store
from service.buildings.tables import Building, Revision
from service.db.process_leases import POLLING, POLLING_LEASE, WORKING, has_passed
from service.db.sessions import free_bytes
from service.jobs.queue import last_progress
from service.jobs.tables import Job, Lease
from service.records import source_schedule
from service.records.sources.source import in_batches
from service.records.tables import SourceState
from service.settings import Settings

MISSED = 3
"""Intervals without a poll after which a source counts as not polled."""
FULL = 20
"""The disk counts as full when less than this fraction (1 / FULL) of `disk_reserve` is free; alerts come long before.
"""
MIB = 2**20


@dataclass(frozen=True, slots=True)
class Check:
    """One condition for the service to work."""

    name: str
    ok: bool
    found: str
    """State for display."""
    helps: str = ""
    """Remedy; empty if none is needed."""
    since: datetime | None = None
    """Start of the state, if stored."""


def checks(session: Session, settings: Settings, now: datetime) -> tuple[Check, ...]:
    """All checks, in the order in which one failure may cause the next."""
    return (
        _disk(session, settings),
        _clock(session, settings, now),
        _poller(session, now),
        _looks(session, settings, now),
        _worker(session, settings, now),
    )


def lacks(session: Session, settings: Settings, now: datetime) -> Iterator[str]:
    """Descriptions of the failed checks."""
    return (one.found for one in checks(session, settings, now) if not one.ok)


def _disk(session: Session, settings: Settings) -> Check:
    free, least = free_bytes(session), settings.data_health.disk_reserve / FULL
    if free is not None and free < least:
        return Check(
            "disk",
            False,
            f"the disk of the database is full: {free / MIB:.0f} MiB are free, {least / MIB:.0f} MiB are needed",
            "free some space, or give the database a larger disk",
        )
    return Check("disk", True, "the database is on a server" if free is None else "the disk of the database has room")


def _clock(session: Session, settings: Settings, now: datetime) -> Check:
    """Check that no stored time lies after now, which would mean a wrong clock."""
    tolerance = timedelta(seconds=settings.data_health.clock_tolerance)
    written = [
        session.scalar(select(func.max(SourceState.looked_at))),
        session.scalar(select(func.max(Job.finished_at))),
        *(until - length for until, length in _leases(session, settings).values()),
    ]
    latest = max((one for one in written if one is not None), default=now)
    if latest <= now + tolerance:
        return Check("clock", True, "nothing stored is later than this machine's clock")
    return Check(
        "clock",
        False,
        f"the clock jumped: results are stored that are {(latest - now).total_seconds():.0f} s later than this clock",
        "check the clocks of all machines, and that they follow a time server (NTP); times stored meanwhile are wrong",
    )


def _poller(session: Session, now: datetime) -> Check:
    until = session.scalar(select(Lease.until).where(Lease.name == POLLING))
    if until is not None and not has_passed(until, now, POLLING_LEASE):
        return Check("poller", True, "a poller runs")
    since = None if until is None else until - POLLING_LEASE
    helps = "'menshin poll' or 'menshin up' starts one; if one is running, see its log"
    return Check("poller", False, "no poller was seen lately", helps, since)


def _looks(session: Session, settings: Settings, now: datetime) -> Check:
    late = _late(session, settings, now)
    if not late:
        return Check("looks", True, "every source is polled in time")
    number = "one source has" if len(late) == 1 else f"{len(late)} sources have"
    helps = "see the poller's log; if it has too many sources, start another poller or set a longer polling.interval"
    return Check("looks", False, f"{number} not been polled for too long", helps, min(late))


def _late(session: Session, settings: Settings, now: datetime) -> list[datetime]:
    """Time of the last or the first possible poll of each source that was not polled in time."""
    patience = MISSED * settings.polling.interval + (settings.polling.retries + 1) * settings.polling.timeout
    described = select(Revision.building_id, func.max(Revision.created_at).label("at")).group_by(Revision.building_id)
    newest = described.subquery()
    query = (
        select(Building.id, newest.c.at, SourceState.looked_at, SourceState.failing_since)
        .join(newest, newest.c.building_id == Building.id)
        .outerjoin(SourceState, SourceState.building_id == Building.id)
    )
    late, described_since = list[datetime](), dict[int, datetime]()
    for number, since, looked_at, failing_since in session.execute(query):
        looked = max(since, looked_at or since)
        rest = source_schedule.LONGEST_PAUSE if failing_since else 0.0
        if now - looked <= timedelta(seconds=patience + rest):
            continue
        if looked_at is not None and looked_at >= since:
            late.append(looked)
        else:  # the newest description may be without a source
            described_since[number] = looked
    late += [
        described_since[building.id]
        for numbers in in_batches(list(described_since))
        for building, revision in building_queries.by_number(session, numbers)
        if building_store.parsed(revision).source is not None
    ]
    return late


def _worker(session: Session, settings: Settings, now: datetime) -> Check:
    lease = timedelta(seconds=settings.jobs.lease)
    lease_row = session.execute(select(Lease.until, Lease.trouble).where(Lease.name == WORKING)).one_or_none()
    until = None if lease_row is None else lease_row.until
    helps = "'menshin work' or 'menshin up' starts one; if one is running, see its log"
    if until is None or has_passed(until, now, lease):
        return Check("worker", False, "no worker was seen lately", helps, None if until is None else until - lease)
    if lease_row is not None and lease_row.trouble is not None:
        trouble, _, remedy = lease_row.trouble.partition("; ")
        return Check("worker", False, f"the worker waits: {trouble}", remedy, until - lease)
    stuck = "records wait for their analysis while nothing gets done"
    oldest = session.scalar(select(func.min(Job.created_at)).where(Job.state == "waiting"))
    patience = timedelta(seconds=settings.data_health.worker_timeout)
    if oldest is not None and now - oldest > patience:
        last = last_progress(session, now, lease) or oldest
        if now - last > patience:
            return Check("worker", False, stuck, helps, max(last, oldest))
    if session.scalar(select(exists().where(Alert.cause == "worker", Alert.closed_at.is_(None)))):
        return Check("worker", False, stuck, helps)
    return Check("worker", True, "a worker runs, and no work waits for too long")


def _leases(session: Session, settings: Settings) -> dict[str, tuple[datetime, timedelta]]:
    """End and length of the leases of pollers and workers, by name."""
    lengths = {POLLING: POLLING_LEASE, WORKING: timedelta(seconds=settings.jobs.lease)}
    rows = session.execute(select(Lease.name, Lease.until).where(Lease.name.in_(lengths)))
    return {name: (until, lengths[name]) for name, until in rows}
