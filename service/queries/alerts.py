"""What is asked about the alerts."""

from collections.abc import Collection, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.database import Alert, AlertChange, Analysis, Event, Inspection


def open_alerts(session: Session, building_id: int, kinds: Collection[str]) -> Sequence[Alert]:
    """The building's alerts of these kinds that are neither resolved nor withdrawn, by number."""
    is_open = (Alert.building_id == building_id, Alert.kind.in_(kinds), Alert.closed_at.is_(None))
    return session.scalars(select(Alert).where(*is_open).order_by(Alert.id)).all()


def acknowledgements(session: Session, building_id: int) -> Sequence[tuple[str, AlertChange]]:
    """(cause, change) of every alert of the building that somebody acknowledged."""
    made = (Alert.building_id == building_id, AlertChange.state == "acknowledged", AlertChange.by.is_not(None))
    question = select(Alert.cause, AlertChange).join(Alert, Alert.id == AlertChange.alert_id).where(*made)
    return [(cause, change) for cause, change in session.execute(question.order_by(AlertChange.id))]


def inspections(session: Session, building_id: int) -> Sequence[tuple[str, Inspection]]:
    """(cause, inspection) of every alert of the building that was inspected."""
    question = select(Alert.cause, Inspection).join(Alert, Alert.id == Inspection.alert_id)
    found = session.execute(question.where(Alert.building_id == building_id).order_by(Inspection.id))
    return [(cause, inspection) for cause, inspection in found]


def has_newer_results(session: Session, alert: Alert) -> bool:
    """Whether events up to the one that raised an alert have results that were not there when it was found last."""
    if alert.raised_event is None:
        return False
    older = (Event.building_id == alert.building_id, Event.start <= alert.raised_event.start)
    newer = select(Analysis.id).join(Event, Event.id == Analysis.event_id)
    question = newer.where(*older, Analysis.created_at > alert.updated_at).limit(1)
    return session.scalar(question) is not None
