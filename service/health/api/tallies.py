"""What the database has in numbers and times, by label: each tally is one statement."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import Select, case, func, select
from sqlalchemy.orm import Session

from service.alerts.tables import Alert
from service.analyses.tables import Analysis
from service.buildings.tables import Building
from service.jobs.tables import Job
from service.notify.tables import Delivery, Receiver
from service.records.tables import Event, Recording, SourceState
from service.verdict import reading

Counted = Mapping[str, float]
"""A number by label; by an empty one where there is but one number."""


def events_by_state(session: Session) -> Counted:
    """Number of events by state."""
    return _counted(session, select(Event.state, func.count()).group_by(Event.state))


def jobs_by_state(session: Session) -> Counted:
    """Number of jobs by state."""
    return _counted(session, select(Job.state, func.count()).group_by(Job.state))


def oldest_waiting_job(session: Session) -> Counted:
    """Unix time at which the oldest job that waits was made; empty if none waits."""
    found = session.scalar(select(func.min(Job.created_at)).where(Job.state == "waiting"))
    return {} if found is None else {"": found.timestamp()}


def last_good_records(session: Session) -> Counted:
    """Unix time at which the last record that could be read ends, by code of the building."""
    question = select(Building.code, func.max(Recording.end)).join(Recording, Recording.building_id == Building.id)
    return _times(session, question.where(Recording.state == "read").group_by(Building.code))


def failing_sources(session: Session) -> Counted:
    """Unix time since which the source has been failing, by code of the building; those that answer are not in it."""
    question = select(Building.code, SourceState.failing_since)
    return _times(session, question.join(SourceState, SourceState.building_id == Building.id))


def verdicts(session: Session) -> Counted:
    """Rank of the verdict by code of the building; 0 is normal, 5 act."""
    every = session.scalars(select(Building)).all()
    return {building.code: float(reading.of_building(session, building).level.rank) for building in every}


def open_alerts(session: Session) -> Counted:
    """Number of alerts that have not ended, by code of the building."""
    is_open = (Alert.building_id == Building.id) & Alert.closed_at.is_(None)
    question = select(Building.code, func.count(Alert.id)).outerjoin(Alert, is_open)
    return _counted(session, question.group_by(Building.code))


def refused_recordings(session: Session) -> Counted:
    """Number of files of which nothing could be used, by code of the building."""
    refused = (Recording.building_id == Building.id) & (Recording.state == "refused")
    question = select(Building.code, func.count(Recording.id)).outerjoin(Recording, refused)
    return _counted(session, question.group_by(Building.code))


def analyses_by_outcome(session: Session) -> Counted:
    """Number of analyses with a result, and of those that refused their event."""
    outcome = case((Analysis.refusal.is_(None), "result"), else_="refused")
    return _counted(session, select(outcome, func.count()).group_by(outcome))


def deliveries_by_state(session: Session) -> Counted:
    """Number of messages on their way to one receiver each, by state."""
    return _counted(session, select(Delivery.state, func.count()).group_by(Delivery.state))


def oldest_waiting_delivery(session: Session) -> Counted:
    """Unix time at which the oldest message that has not arrived was put into the outbox; empty if none waits."""
    waiting = Delivery.state.in_(("waiting", "sending"))
    found = session.scalar(select(func.min(Delivery.created_at)).where(waiting))
    return {} if found is None else {"": found.timestamp()}


def failed_deliveries(session: Session) -> Counted:
    """Number of messages that were given up, by code of the building."""
    failed = (Delivery.receiver_id == Receiver.id) & (Delivery.state == "failed")
    question = select(Building.code, func.count(Delivery.id)).outerjoin(Receiver, Receiver.building_id == Building.id)
    return _counted(session, question.outerjoin(Delivery, failed).group_by(Building.code))


def _counted(session: Session, question: Select[*tuple[Any, ...]]) -> Counted:
    return {label: float(number) for label, number in session.execute(question)}


def _times(session: Session, question: Select[*tuple[Any, ...]]) -> Counted:
    return {label: time.timestamp() for label, time in session.execute(question) if time is not None}
