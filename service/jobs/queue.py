"""The queue of jobs in the database: claimed under a lease, finished under a fencing token."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from sqlalchemy import and_, case, exists, func, or_, select, update
from sqlalchemy.orm import Session, aliased

from service.buildings.tables import Building
from service.db.process_leases import is_wrong
from service.errors import TooManyRequestsError
from service.jobs.tables import Job
from service.models.tables import ModelVersion
from service.records.tables import Event

ANALYSE, COMPARE, FIT, EXTEND, DIAGNOSE, WATCH = "analyse", "compare", "fit", "extend", "diagnose", "watch"
FORECAST, SKETCH, IMPROVE, SENSORS = "forecast", "sketch", "improve", "sensors"
"""Kinds of jobs: ANALYSE for an event, WATCH and SENSORS for a building, the others for a model."""
UNDER_WAY = ("waiting", "running")
"""States of a job that has not ended."""
MOST_REQUESTED = 100
"""Jobs of one key that may wait or run at the same time."""
WORN = 3
"""Claims after which a job loses its precedence, because it may be crashing its workers."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A worker's right to a job, until its lease expires or another worker takes over."""

    job_id: int
    kind: str
    event_id: int | None
    model_id: int | None
    building_id: int | None
    arguments: Mapping[str, Any]
    token: int
    """Number of claims of the job up to this one."""
    failures: int
    """Number of failed attempts."""


def enqueue(
    session: Session, event: Event, arguments: Mapping[str, Any], now: datetime, asked_by: str | None = None
) -> Job:
    """Queue the analysis of an event, in the transaction that stores the event; an equal waiting job is used
    instead.

    Args:
        session: of the transaction.
        event: a stored event.
        arguments: analysis settings that differ from the service's own, by name.
        now: aware time.
        asked_by: name of the key that requested it; None for an earthquake that has just been recorded.

    Raises:
        TooManyRequestsError: the key has too many jobs under way.
    """
    job = Job(kind=ANALYSE, event_id=event.id, arguments=dict(arguments), asked_by=asked_by, created_at=now)
    queued = _queued(session, job)
    event.state, event.reason, event.updated_at = "queued", None, now
    return queued


def enqueue_first(session: Session, event: Event, now: datetime) -> None:
    """Queue the analysis of an event that this transaction added, so that no other job for it can exist yet."""
    session.add(
        Job(kind=ANALYSE, event_id=event.id, arguments={}, state="waiting", claims=0, failures=0, created_at=now)
    )
    event.state, event.reason, event.updated_at = "queued", None, now


def enqueue_work(
    session: Session, model: ModelVersion, kind: str, arguments: Mapping[str, Any], asked_by: str | None, now: datetime
) -> Job:
    """Queue a job for a model; an equal waiting job is used instead.

    Args:
        session: of the transaction.
        model: a stored version.
        kind: one of service.kinds.
        arguments: the kind's own, by name.
        asked_by: name of the key that requested it; None for jobs of the service itself.
        now: aware time.
    """
    return _queued(
        session, Job(kind=kind, model_id=model.id, arguments=dict(arguments), asked_by=asked_by, created_at=now)
    )


def enqueue_monitoring(session: Session, building_id: int, asked_by: str | None, now: datetime) -> Job:
    """Queue the drift monitoring of a building, in the transaction that stores its data.

    Args:
        session: of the transaction.
        building_id: of a stored building.
        asked_by: name of the key that requested it; None for jobs of the service itself.
        now: aware time.
    """
    return _queued(session, Job(kind=WATCH, building_id=building_id, arguments={}, asked_by=asked_by, created_at=now))


def enqueue_sensors(
    session: Session, building_id: int, arguments: Mapping[str, Any], asked_by: str, now: datetime
) -> Job:
    """Queue the search for the best place of one more sensor; an equal waiting job is used instead.

    Args: as of `enqueue_work`.
    """
    job = Job(kind=SENSORS, building_id=building_id, arguments=dict(arguments), asked_by=asked_by, created_at=now)
    return _queued(session, job)


def is_monitoring_pending(session: Session, building_id: int) -> bool:
    """True if drift monitoring of the building waits or runs, so that its result is pending."""
    of_building = (Job.kind == WATCH, Job.building_id == building_id)
    latest = session.scalar(select(Job.state).where(*of_building).order_by(Job.id.desc()).limit(1))
    return latest in UNDER_WAY


def claim(session: Session, now: datetime, lease: timedelta) -> Claim | None:
    """Take the most urgent job that no worker has; None if there is none.

    Earthquakes that were just recorded come first, the strongest before all others, then what follows from them by
    itself, then what people requested. The drift monitoring of a building whose earthquakes are all analysed precedes
    them: its verdict and messages depend on it. Among equals the job with the fewest claims comes first, then the
    stronger earthquake, then the oldest. A job with WORN claims comes last.
    """
    lapsed = and_(Job.state == "running", or_(Job.claimed_until < now, is_wrong(Job.claimed_until, now, lease)))
    worn = case((Job.claims >= WORN, 1), else_=0)
    other, of_other = aliased(Job), aliased(Event)
    own = (other.kind == ANALYSE, other.state.in_(UNDER_WAY), other.asked_by.is_(None))
    is_pending = exists().where(of_other.id == other.event_id, of_other.building_id == Job.building_id, *own)
    completes = and_(Job.kind == WATCH, ~is_pending)
    urgency = case((Job.asked_by.is_not(None), 3), (completes, 0), (Job.kind == ANALYSE, 1), else_=2)
    strength = func.coalesce(Event.recorded_peak, 0.0).desc()
    job = session.scalar(
        select(Job)
        .outerjoin(Event, Event.id == Job.event_id)
        .where(or_(Job.state == "waiting", lapsed))
        .order_by(worn, urgency, Job.claims, strength, Job.id)
        .limit(1)
        .with_for_update(skip_locked=True, of=Job)
    )
    if job is None:
        return None
    job.state, job.claimed_until, job.claims = "running", now + lease, job.claims + 1
    return Claim(job.id, job.kind, job.event_id, job.model_id, job.building_id, job.arguments, job.claims, job.failures)


def extend(session: Session, claim: Claim, now: datetime, lease: timedelta) -> bool:
    """Extend the lease of a job; False if the claim is no longer valid."""
    return _change(session, claim, claimed_until=now + lease)


def report_progress(session: Session, claim: Claim, done: int, stages: int, doing: str, share: float) -> bool:
    """Store the progress of a job; False if the claim is no longer valid."""
    return _change(session, claim, progress={"done": done, "stages": stages, "doing": doing, "share": share})


def finish(session: Session, claim: Claim, now: datetime) -> bool:
    """Mark the job as done; False if the claim is no longer valid, and then nothing may be stored for it."""
    return _change(session, claim, state="done", claimed_until=None, error=None, finished_at=now)


def refuse(session: Session, claim: Claim, refusal: str, now: datetime) -> bool:
    """Mark the job as rejected: another attempt would not help. False if the claim is no longer valid."""
    if not _change(session, claim, state="done", claimed_until=None, error=None, refusal=refusal, finished_at=now):
        return False
    _end_event(session, claim, "refused", refusal, now)
    return True


def release(session: Session, claim: Claim) -> bool:
    """Return the job to the queue at once; False if the claim is no longer valid."""
    return _change(session, claim, state="waiting", claimed_until=None)


def fail(session: Session, claim: Claim, error: str, now: datetime, attempts: int) -> bool:
    """Count a failed attempt: the job waits for the next one, or fails after the last, and its event shows the
    reason.

    Returns:
        False if the claim is no longer valid.
    """
    failures = claim.failures + 1
    if failures < attempts:
        return _change(session, claim, state="waiting", claimed_until=None, error=error, failures=failures)
    if not _change(session, claim, state="failed", claimed_until=None, error=error, failures=failures, finished_at=now):
        return False
    _end_event(session, claim, "failed", last_line(error), now)
    return True


def still_running(session: Session, claims: Collection[Claim]) -> set[int]:
    """Numbers of the claimed jobs that were neither cancelled nor claimed by another worker."""
    query = select(Job.id, Job.claims).where(Job.id.in_([claim.job_id for claim in claims]), Job.state == "running")
    tokens = {claim.job_id: claim.token for claim in claims}
    return {number for number, token in session.execute(query) if tokens[number] == token}


def neglected_since(session: Session, now: datetime, lease: timedelta) -> Mapping[int, datetime]:
    """Time since which the oldest job of a building waits, or its worker is silent, by building.

    Buildings without a neglected job are omitted. One statement for all of them, which reads the undone jobs only.
    """
    building_id = func.coalesce(Job.building_id, Event.building_id, ModelVersion.building_id)
    jobs = (
        select(building_id, func.min(func.coalesce(Job.claimed_until, Job.created_at)))
        .outerjoin(Event, Event.id == Job.event_id)
        .outerjoin(ModelVersion, ModelVersion.id == Job.model_id)
    )
    silent = or_(Job.claimed_until < now, is_wrong(Job.claimed_until, now, lease))
    neglected = or_(Job.state == "waiting", silent)
    rows = session.execute(jobs.where(Job.state.in_(UNDER_WAY), neglected).group_by(building_id))
    return {building: since for building, since in rows if building is not None}


def last_progress(session: Session, now: datetime, lease: timedelta) -> datetime | None:
    """Last time at which a worker finished a job or renewed a lease; None before the first.

    Times after now come from a wrong clock and are ignored.
    """
    finished = session.scalar(select(func.max(Job.finished_at)).where(Job.finished_at <= now))
    leased = session.scalar(
        select(func.max(Job.claimed_until)).where(Job.state == "running", Job.claimed_until <= now + lease)
    )
    return max((time for time in (finished, leased and leased - lease) if time is not None), default=None)


def _end_event(session: Session, claim: Claim, state: str, reason: str, now: datetime) -> None:
    if claim.event_id is not None:
        event = session.get_one(Event, claim.event_id)
        event.state, event.reason, event.updated_at = state, reason, now


def _queued(session: Session, job: Job) -> Job:
    """The job, or an equal one that still waits and comes after all running ones of its kind.

    Two transactions that queue work on the same object run one after the other. A suitable job is locked: no worker
    takes it before what this transaction stores can be seen. One that another transaction has locked, which begins or
    cancels it, will not do, nor will one before a job that was begun later, for that one's result is the one that
    counts, and it has seen less.
    """
    for about, number in ((Event, job.event_id), (ModelVersion, job.model_id), (Building, job.building_id)):
        if number is not None:
            session.execute(select(about.id).where(about.id == number).with_for_update(key_share=True))
    alike = (
        Job.kind == job.kind,
        Job.event_id == job.event_id,
        Job.model_id == job.model_id,
        Job.building_id == job.building_id,
    )
    query = select(Job).where(*alike, Job.state == "waiting").order_by(Job.id.desc())
    query = query.with_for_update(of=Job, skip_locked=True).execution_options(populate_existing=True)
    waiting = session.scalars(query).all()
    started = session.scalar(select(func.max(Job.id)).where(*alike, Job.state != "waiting")) or 0
    for one in waiting:
        if one.id > started and one.arguments == job.arguments:
            if job.asked_by is None:
                one.asked_by = None  # the service needs it too, and sooner
            return one
    if job.asked_by is not None:
        _check_quota(session, job.asked_by)
    job.state, job.claims, job.failures = "waiting", 0, 0
    session.add(job)
    session.flush()
    return job


def _check_quota(session: Session, key: str) -> None:
    """Reject further jobs of a key that has too many pending."""
    requested = select(func.count()).where(Job.asked_by == key, Job.kind != WATCH, Job.state.in_(UNDER_WAY))
    if (session.scalar(requested) or 0) >= MOST_REQUESTED:
        raise TooManyRequestsError(
            f"The key {key!r} has {MOST_REQUESTED} jobs under way, the most that one key may have. Wait until "
            "some have ended, or cancel some."
        )


def last_line(error: str) -> str:
    """The line of a traceback that names the error."""
    return error.strip().splitlines()[-1]


def _change(session: Session, claim: Claim, **values: object) -> bool:
    valid = (Job.id == claim.job_id, Job.state == "running", Job.claims == claim.token)
    return session.connection().execute(update(Job).where(*valid).values(**values)).rowcount == 1
