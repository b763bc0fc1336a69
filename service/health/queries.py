"""Queries for the checks of data health."""

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from service.analyses.tables import Analysis
from service.db.process_leases import is_wrong
from service.db.select import Line
from service.jobs.queue import UNDER_WAY
from service.jobs.tables import Job
from service.models.tables import ModelVersion
from service.records.tables import Event, EventRecording, Recording, Waveform


def latest_events(session: Session, building_id: int, count: int) -> Sequence[Line]:
    """(number, start, screening findings or None) of the building's latest events, the earliest first.

    Events that wait for files or their analysis are omitted.
    """
    ended = (Event.building_id == building_id, Event.state.in_(("analysed", "refused")))
    query = select(Event.id, Event.start, Analysis.quality).outerjoin(
        Analysis, (Analysis.event_id == Event.id) & Analysis.current
    )
    return session.execute(query.where(*ended).order_by(Event.start.desc()).limit(count)).all()[::-1]


def channels_of(session: Session, events: Sequence[int]) -> Mapping[int, set[str]]:
    """Recorded channels by event; events without any are omitted."""
    channels: dict[int, set[str]] = {}
    query = select(Waveform.event_id, Waveform.channel).where(Waveform.event_id.in_(events)).distinct()
    for event, channel in session.execute(query):
        channels.setdefault(event, set()).add(channel)
    return channels


def files_of(session: Session, events: Sequence[int]) -> Mapping[int, tuple[str, ...]]:
    """Names of the files and downloads of each event, in order of arrival."""
    query = select(EventRecording.event_id, Recording.name).join(Recording, Recording.id == EventRecording.recording_id)
    files: dict[int, tuple[str, ...]] = {}
    for event, name in session.execute(query.where(EventRecording.event_id.in_(events)).order_by(Recording.id)):
        files[event] = (*files.get(event, ()), name)
    return files


def channels_ever(session: Session, building_id: int) -> set[str]:
    """Channels that the building has ever recorded."""
    query = select(Waveform.channel).join(Event, Event.id == Waveform.event_id)
    return set(session.scalars(query.where(Event.building_id == building_id).distinct()))


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
