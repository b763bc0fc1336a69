"""How does a message get on its way? In the transaction that stores what it tells of."""

import hashlib
from collections.abc import Sequence
from datetime import datetime
from uuid import uuid4

import orjson
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.buildings import recipients
from service.buildings.tables import Building
from service.notify.notice import Notice
from service.notify.tables import Delivery, Message, Receiver

NO_RECIPIENTS = "no recipients"
NOT_WANTED = "no recipient wants messages of this kind and severity"
"""Why a message goes to nobody."""
ENDED = ("delivered", "failed", "dropped")
"""States of deliveries that nothing more is done about."""


def put(session: Session, notice: Notice, now: datetime) -> Message:
    """Put a notice into the outbox, for every receiver whose rule it meets.

    A notice that tells people nothing but what the last message of its key told them is not put again: another
    `sequence` than `cancelled` or `repeat`, another link, picture or `data` alone is no news. A reminder (`repeat`) so
    has to say of when it is. Whoever was told of a thing is told what becomes of it, even where its rule asks for
    graver news only.

    Args:
        session: of the transaction that stores what the notice tells of.
        notice: what is to be told.
        now: aware time.

    Returns:
        The message; that of before, if this one is no news.
    """
    _held(session, notice.building_id)
    of_key = (Message.building_id == notice.building_id, Message.key == notice.key)
    last = session.scalars(select(Message).where(*of_key).order_by(Message.number.desc()).limit(1)).one_or_none()
    if last is not None and last.digest == _digest(notice):
        return last
    told = set(session.scalars(select(Delivery.receiver_id).join(Delivery.message).where(*of_key)))
    wanting = [
        receiver
        for receiver in recipients.of_building(session, notice.building_id)
        if _wants(receiver, notice) or receiver.id in told
    ]
    return put_for(session, notice, wanting, now)


def put_for(session: Session, notice: Notice, wanting: Sequence[Receiver], now: datetime) -> Message:
    """Put a notice into the outbox for these receivers, whatever their rules."""
    of_key = (Message.building_id == notice.building_id, Message.key == notice.key)
    before = session.scalar(select(func.max(Message.number)).where(*of_key))
    message = _message(notice, 1 + (before or 0), now)
    message.deliveries = [
        Delivery(receiver_id=receiver.id, state="waiting", due_at=now, created_at=now) for receiver in wanting
    ]
    if not wanting:
        message.unsent = NOT_WANTED if recipients.of_building(session, notice.building_id) else NO_RECIPIENTS
    session.add(message)
    session.flush()
    return message


def hand_on(session: Session, building_id: int, messages: Sequence[Message], now: datetime) -> None:
    """Send messages of what is still open to the recipients that want them and were none when they were written.

    One whose address changed since it was sent, or that was removed and came back, gets it once more.
    """
    _held(session, building_id)
    for message in messages:
        session.refresh(message, ["deliveries"])
        sent = {one.receiver_id: one for one in message.deliveries}
        for receiver in recipients.of_building(session, building_id):
            before = sent.get(receiver.id)
            if not _wants(receiver, message):
                continue
            if before is None:
                message.deliveries.append(
                    Delivery(receiver_id=receiver.id, state="waiting", due_at=now, created_at=now)
                )
            elif before.state in ENDED and receiver.since is not None and before.created_at < receiver.since:
                before.state, before.due_at, before.created_at = "waiting", now, now
                before.finished_at, before.tries = None, 0
    session.flush()


def _held(session: Session, building_id: int) -> None:
    """Two transactions with news of one thing come one after the other."""
    session.scalars(select(Building).where(Building.id == building_id).with_for_update(key_share=True)).one()


def _message(notice: Notice, number: int, now: datetime) -> Message:
    event_id, direction = notice.picture or (None, None)
    return Message(
        identity=f"msg_{uuid4().hex}",
        building_id=notice.building_id,
        key=notice.key,
        number=number,
        kind=notice.kind,
        sequence=notice.sequence,
        severity=notice.severity,
        subject=notice.subject,
        sentences=list(notice.sentences),
        facts=[{"name": name, "value": value} for name, value in notice.facts],
        link=notice.link,
        picture_event_id=event_id,
        picture_direction=direction,
        data=dict(notice.data),
        digest=_digest(notice),
        is_over=notice.is_over,
        created_at=now,
    )


def _wants(receiver: Receiver, notice: Notice | Message) -> bool:
    return notice.kind in receiver.kinds and notice.severity in receiver.severities


def _digest(notice: Notice) -> str:
    """SHA-256 of what people read, or of what decides whether it is news."""
    if notice.news is not None:
        return _digest(notice.news)
    order = notice.sequence if notice.sequence in ("cancelled", "repeat") else None
    read = (notice.kind, notice.severity, order, notice.subject, notice.sentences, notice.facts)
    return hashlib.sha256(orjson.dumps(read)).hexdigest()
