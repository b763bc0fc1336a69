"""Receivers, messages and deliveries as the API answers them, from their rows."""

from collections.abc import Sequence
from typing import TypeVar

from sqlalchemy.orm import Session

from service.access.roles import Role
from service.buildings.recipient_rules import shown_address
from service.notify import queries
from service.notify.schema import (
    AttemptOut,
    DeliveryOut,
    DeliveryRow,
    FactOut,
    MessageOut,
    MessageRow,
    ReceiverOut,
)
from service.notify.tables import Delivery, DeliveryAttempt, Message, Receiver

HIDDEN = "(engineers see it)"
"""In place of what only engineers see."""
Seen = TypeVar("Seen", ReceiverOut, MessageOut, DeliveryRow, DeliveryOut)


def seen_by(role: Role, answer: Seen) -> Seen:
    """The same as a role may see it: viewers see neither receivers' addresses nor what receivers answered."""
    if role >= Role.engineer:
        return answer
    hidden: dict[str, object] = {}
    if isinstance(answer, ReceiverOut):
        hidden["address"] = HIDDEN
    if isinstance(answer, DeliveryRow):
        hidden["last_answer"] = answer.last_answer and HIDDEN
    if isinstance(answer, DeliveryOut):
        hidden["log"] = [
            one.model_copy(update={"address": HIDDEN, "answer": one.answer and HIDDEN}) for one in answer.log
        ]
    if isinstance(answer, MessageOut):
        hidden["deliveries"] = [seen_by(role, one) for one in answer.deliveries]
    return answer.model_copy(update=hidden)


def receiver(row: Receiver) -> ReceiverOut:
    """A receiver, without what is secret."""
    return ReceiverOut(
        id=row.id,
        building=row.building.code,
        name=row.name,
        kind=row.kind,
        address=shown_address(row.kind, row.address),
        kinds=row.kinds,
        severities=row.severities,
        origin=row.origin,
        created_by=row.created_by,
        created_at=row.created_at,
    )


def message_row(row: Message) -> MessageRow:
    """A message in a list."""
    states = [delivery.state for delivery in row.deliveries]
    return MessageRow(
        id=row.id,
        identity=row.identity,
        building=row.building.code,
        about=row.key,
        number=row.number,
        kind=row.kind,
        sequence=row.sequence,
        severity=row.severity,
        subject=row.subject,
        created_at=row.created_at,
        receivers=len(states),
        unsent=row.unsent,
        delivered=states.count("delivered"),
        failed=states.count("failed"),
    )


def message(session: Session, row: Message) -> MessageOut:
    """A message, whole."""
    return MessageOut(
        **message_row(row).model_dump(),
        sentences=row.sentences,
        facts=[FactOut(**fact) for fact in row.facts],
        link=row.link,
        values=row.data,
        deliveries=delivery_rows(session, row.deliveries),
    )


def delivery_rows(session: Session, rows: Sequence[Delivery]) -> list[DeliveryRow]:
    """Deliveries in a list."""
    last = queries.last_attempts(session, rows)
    return [_delivery_row(row, last.get(row.id)) for row in rows]


def delivery(row: Delivery) -> DeliveryOut:
    """A delivery with every attempt."""
    log = [AttemptOut.model_validate(attempt) for attempt in row.attempts]
    return DeliveryOut(**_delivery_row(row, row.attempts[-1] if row.attempts else None).model_dump(), log=log)


def _delivery_row(row: Delivery, last: DeliveryAttempt | None) -> DeliveryRow:
    return DeliveryRow(
        id=row.id,
        building=row.message.building.code,
        message=row.message_id,
        about=row.message.key,
        kind=row.message.kind,
        severity=row.message.severity,
        subject=row.message.subject,
        receiver=row.receiver_id,
        receiver_name=row.receiver.name,
        receiver_kind=row.receiver.kind,
        state=row.state,
        attempts=row.claims,
        due_at=row.due_at if row.state == "waiting" else None,
        last_answer=last.answer if last else None,
        created_at=row.created_at,
        finished_at=row.finished_at,
    )
