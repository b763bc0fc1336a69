"""Queries of alerts, silences and the messages about them."""

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from datetime import datetime

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session, joinedload, selectinload

from service.alerts.tables import Alert, AlertChange, AlertComment, Inspection, Silence
from service.analyses.tables import Analysis
from service.db.select import Line
from service.errors import NotFoundError
from service.notify.tables import Delivery, Message, Receiver
from service.records.tables import Event


def open_alerts(session: Session, building_id: int, kinds: Collection[str]) -> Sequence[Alert]:
    """The building's alerts of these kinds that are neither resolved nor withdrawn, by number."""
    is_open = (Alert.building_id == building_id, Alert.kind.in_(kinds), Alert.closed_at.is_(None))
    return session.scalars(select(Alert).where(*is_open).order_by(Alert.id)).all()


def acknowledgements(session: Session, building_id: int) -> Sequence[tuple[str, AlertChange]]:
    """(cause, change) of every alert of the building that a person acknowledged."""
    made = (Alert.building_id == building_id, AlertChange.state == "acknowledged", AlertChange.by.is_not(None))
    query = select(Alert.cause, AlertChange).join(Alert, Alert.id == AlertChange.alert_id).where(*made)
    return [(cause, change) for cause, change in session.execute(query.order_by(AlertChange.id))]


def inspections(session: Session, building_id: int) -> Sequence[tuple[str, Inspection]]:
    """(cause, inspection) of every alert of the building that was inspected."""
    query = select(Alert.cause, Inspection).join(Alert, Alert.id == Inspection.alert_id)
    rows = session.execute(query.where(Alert.building_id == building_id).order_by(Inspection.id))
    return [(cause, inspection) for cause, inspection in rows]


def has_newer_results(session: Session, alert: Alert) -> bool:
    """True if events up to the one that raised an alert have results newer than its evidence."""
    if alert.raised_event is None:
        return False
    older = (Event.building_id == alert.building_id, Event.start <= alert.raised_event.start)
    newer = select(Analysis.id).join(Event, Event.id == Analysis.event_id)
    query = newer.where(*older, Analysis.created_at > alert.updated_at).limit(1)
    return session.scalar(query) is not None


def alert(session: Session, number: int) -> Alert:
    """An alert.

    Raises:
        NotFoundError: there is none with that number.
    """
    row = session.get(Alert, number)
    if row is None:
        raise NotFoundError("alert", number)
    return row


def every(
    session: Session,
    building_id: int | None,
    state: str | None,
    kind: str | None,
    before: int | None,
    limit: int | None,
) -> Sequence[Alert]:
    """Alerts, the latest first; the state `open` is every state of an alert that has not ended.

    Args:
        session: to read with.
        building_id: of one building; None: of all.
        state: one of service.alerts.lifecycle, or `open`; None: any.
        kind: one of service.alerts.candidates.Kind; None: any.
        before: the last number of the previous page.
        limit: rows; None: all.
    """
    query = select(Alert).options(joinedload(Alert.building))
    for column, wanted in ((Alert.building_id, building_id), (Alert.kind, kind)):
        if wanted is not None:
            query = query.where(column == wanted)
    if state is not None:
        query = query.where(Alert.closed_at.is_(None) if state == "open" else Alert.state == state)
    if before is not None:
        query = query.where(Alert.id < before)
    return session.scalars(query.order_by(Alert.id.desc()).limit(limit)).all()


def open_counts(session: Session, buildings: Collection[int]) -> Mapping[int, int]:
    """Number of alerts that have not ended, by the building's number; buildings without any are omitted."""
    are_open = (Alert.building_id.in_(buildings), Alert.closed_at.is_(None))
    query = select(Alert.building_id, func.count()).where(*are_open).group_by(Alert.building_id)
    return {row[0]: row[1] for row in session.execute(query)}


def comment_counts(session: Session, alerts: Collection[int]) -> Mapping[int, int]:
    """Number of comments by alert; alerts without any are omitted."""
    query = select(AlertComment.alert_id, func.count()).where(
        AlertComment.alert_id.in_(alerts), AlertComment.text != ""
    )
    return {row[0]: row[1] for row in session.execute(query.group_by(AlertComment.alert_id))}


def last_comments(session: Session, alerts: Collection[int]) -> Mapping[int, AlertComment]:
    """The last comment on each alert; alerts without any are omitted."""
    last = select(func.max(AlertComment.id)).where(AlertComment.alert_id.in_(alerts), AlertComment.text != "")
    query = select(AlertComment).where(AlertComment.id.in_(last.group_by(AlertComment.alert_id)))
    return {one.alert_id: one for one in session.scalars(query)}


def deliveries(session: Session, building_id: int, key: str) -> Sequence[Line]:
    """(Message, Delivery | None, name of the receiver | None) of the messages under a key, the earliest first."""
    query = (
        select(Message, Delivery, Receiver.name)
        .outerjoin(Delivery, Delivery.message_id == Message.id)
        .outerjoin(Receiver, Receiver.id == Delivery.receiver_id)
        .where(Message.building_id == building_id, Message.key == key)
    )
    return session.execute(query.order_by(Message.number, Delivery.id)).all()


def silence(session: Session, number: int) -> Silence:
    """A silence.

    Raises:
        NotFoundError: there is none with that number.
    """
    row = session.get(Silence, number)
    if row is None:
        raise NotFoundError("silence", number)
    return row


def of_events(session: Session, events: Collection[int], numbers: Collection[int]) -> Sequence[Alert]:
    """Alerts that these events raised, and those of these numbers, ended ones too, by number, with their changes."""
    wanted = or_(Alert.raised_event_id.in_(events), Alert.id.in_(numbers))
    query = select(Alert).where(wanted).order_by(Alert.id)
    return session.scalars(query.options(selectinload(Alert.changes))).all()


def of_numbers(session: Session, numbers: Collection[int]) -> Sequence[Alert]:
    """Alerts of these numbers, in their order."""
    return session.scalars(select(Alert).where(Alert.id.in_(numbers)).order_by(Alert.id)).all()


def silences(session: Session, building_id: int) -> Sequence[Silence]:
    """Every silence of a building, ended ones too, by number."""
    return session.scalars(select(Silence).where(Silence.building_id == building_id).order_by(Silence.id)).all()


def messages(session: Session, building_id: int, key: str) -> Sequence[Message]:
    """Messages under a key, the earliest first."""
    of_key = (Message.building_id == building_id, Message.key == key)
    return session.scalars(select(Message).where(*of_key).order_by(Message.number)).all()


def messages_by_key(session: Session, building_id: int, keys: Collection[str]) -> Mapping[str, Sequence[Message]]:
    """By key, what `messages` gives; keys without any are omitted."""
    query = select(Message).where(Message.building_id == building_id, Message.key.in_(keys))
    found: dict[str, list[Message]] = defaultdict(list)
    for message in session.scalars(query.order_by(Message.number)):
        found[message.key].append(message)
    return found


def messages_of_alerts(session: Session, building_id: int) -> Sequence[Message]:
    """Messages about events with alerts, the earliest first."""
    of_alerts = (Message.building_id == building_id, Message.kind == "alert", Message.key.like("event/%"))
    return session.scalars(select(Message).where(*of_alerts).order_by(Message.id)).all()


def recipients_of(session: Session, building_id: int, keys: Collection[str]) -> Collection[int]:
    """Numbers of the recipients of messages under these keys."""
    has_keys = (Message.building_id == building_id, Message.key.in_(keys))
    return set(session.scalars(select(Delivery.receiver_id).join(Delivery.message).where(*has_keys)))


def events_to_report(session: Session, building_id: int, since: datetime) -> Sequence[Event]:
    """The building's events that may need a message, the earliest first.

    These are the events that ended since then, those that raised an open alert, and those whose messages reported one.
    """
    of_alerts = (Message.building_id == building_id, Message.kind == "alert", Message.key.like("event/%"))
    reported = {
        int(key.removeprefix("event/")) for key in session.scalars(select(Message.key).where(*of_alerts).distinct())
    }
    raised = select(Alert.raised_event_id).where(Alert.building_id == building_id, Alert.closed_at.is_(None))
    wanted = or_(Event.end >= since, Event.id.in_(raised), Event.id.in_(reported))
    query = select(Event).where(Event.building_id == building_id, wanted)
    return session.scalars(query.order_by(Event.start, Event.id)).all()


def alerts_without_event(session: Session, building_id: int) -> Sequence[Alert]:
    """Alerts of the periodic checks that became active, ended ones too, by number."""
    query = select(Alert).where(Alert.building_id == building_id, Alert.activated_at.is_not(None))
    return session.scalars(query.where(Alert.raised_event_id.is_(None)).order_by(Alert.id)).all()
