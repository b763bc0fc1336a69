"""Queries of messages and their deliveries."""

from collections.abc import Mapping, Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session, joinedload, selectinload

from service.buildings.tables import Building
from service.errors import NotFoundError
from service.notify.tables import Delivery, DeliveryAttempt, Message


def messages(session: Session, building_id: int, before: int | None, limit: int) -> Sequence[Message]:
    """A building's messages with their deliveries, the latest first; `before` is the last id of the previous page."""
    query = select(Message).options(selectinload(Message.deliveries).joinedload(Delivery.receiver))
    query = query.where(Message.building_id == building_id)
    if before is not None:
        query = query.where(Message.id < before)
    return session.scalars(query.order_by(Message.id.desc()).limit(limit)).all()


def message(session: Session, identity: int) -> Message:
    """A message with its building and its deliveries.

    Raises:
        NotFoundError: there is none with that number.
    """
    wanted = (joinedload(Message.building), selectinload(Message.deliveries).joinedload(Delivery.receiver))
    row = session.scalars(select(Message).options(*wanted).where(Message.id == identity)).one_or_none()
    if row is None:
        raise NotFoundError("message", identity, "retention.messages")
    return row


def deliveries(
    session: Session,
    building: str | None,
    receiver_id: int | None,
    state: str | None,
    before: int | None,
    limit: int,
) -> Sequence[Delivery]:
    """Deliveries with their message and receiver, the latest first; `before` is the last id of the previous page."""
    query = select(Delivery).join(Delivery.message).join(Message.building)
    query = query.options(joinedload(Delivery.message).joinedload(Message.building), joinedload(Delivery.receiver))
    for column, wanted in ((Building.code, building), (Delivery.receiver_id, receiver_id), (Delivery.state, state)):
        if wanted is not None:
            query = query.where(column == wanted)
    if before is not None:
        query = query.where(Delivery.id < before)
    return session.scalars(query.order_by(Delivery.id.desc()).limit(limit)).all()


def delivery(session: Session, identity: int) -> Delivery:
    """A delivery with its message, receiver and attempts.

    Raises:
        NotFoundError: there is none with that number.
    """
    wanted = (
        joinedload(Delivery.message).joinedload(Message.building),
        joinedload(Delivery.receiver),
        selectinload(Delivery.attempts),
    )
    row = session.scalars(select(Delivery).options(*wanted).where(Delivery.id == identity)).one_or_none()
    if row is None:
        raise NotFoundError("delivery", identity, "retention.messages")
    return row


def last_attempts(session: Session, deliveries: Sequence[Delivery]) -> Mapping[int, DeliveryAttempt]:
    """The last attempt at each of these deliveries, by its id; without those that have none yet."""
    numbers = [one.id for one in deliveries]
    last = select(func.max(DeliveryAttempt.id)).where(DeliveryAttempt.delivery_id.in_(numbers))
    query = select(DeliveryAttempt).where(DeliveryAttempt.id.in_(last.group_by(DeliveryAttempt.delivery_id)))
    return {one.delivery_id: one for one in session.scalars(query)}
