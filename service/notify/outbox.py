"""The outbox: messages are stored with their deliveries in the transaction that stores their news."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal
from uuid import uuid4

import orjson
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.buildings import recipients
from service.buildings.locking import locked
from service.buildings.recipient_rules import Severity
from service.notify import texts
from service.notify.tables import Delivery, Message, Receiver

Kind = Literal["event", "alert", "data", "drill", "test"]
"""An earthquake, an alert on the building or its sensors, data that stopped, a drill, a test of one recipient."""
Order = Literal["new", "updated", "cancelled", "repeat"]
"""`repeat` reminds of what is still open; it does not mark a second attempt of a delivery."""
ENDED = ("delivered", "failed", "dropped")
"""Final states of deliveries."""


@dataclass(frozen=True, slots=True)
class MessageContent:
    """A message to the recipients of a building, before it is stored."""

    key: str
    """Its subject: `event/17`, `alert/5`. Messages of one key make one thread."""
    building_id: int
    kind: Kind
    sequence: Order
    severity: Severity
    """`normal` only with a verdict of that level."""
    subject: str
    """One line, without the building's name, which is put before it."""
    sentences: tuple[str, ...]
    """One paragraph each, for readers who are not engineers."""
    facts: tuple[tuple[str, str], ...] = ()
    """Names and values with units, in order."""
    link: str = ""
    """Path of the page with the details."""
    picture: tuple[int, str] | None = None
    """Event and direction of the hysteresis loop that is shown."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """For programs, as JSON in SI units."""
    has_ended: bool = False
    """True if nothing of what it reports is open."""
    news: "MessageContent | None" = None
    """Content that decides whether it differs from the last message of its key; None: its own."""

    @property
    def is_over(self) -> bool:
        """True if what it reports no longer holds."""
        return self.has_ended or self.sequence == "cancelled"


def put(session: Session, content: MessageContent, now: datetime) -> Message:
    """Store a message for every recipient that is subscribed to it, unless the last one of its key says the same.

    A different `sequence` (except `cancelled` and `repeat`), link, picture or `data` alone is no news. A reminder
    (`repeat`) therefore has to contain its date. Recipients of earlier messages of the key get the later ones too,
    whatever severity they subscribed to.

    Args:
        session: of the transaction that stores the news.
        content: of the message.
        now: aware time.

    Returns:
        The message; the last one, if this one is no news.
    """
    locked(session, content.building_id)
    of_key = (Message.building_id == content.building_id, Message.key == content.key)
    last = session.scalars(select(Message).where(*of_key).order_by(Message.number.desc()).limit(1)).one_or_none()
    if last is not None and not is_news(content, last):
        return last
    reached = set(session.scalars(select(Delivery.receiver_id).join(Delivery.message).where(*of_key)))
    receivers = [
        receiver
        for receiver in recipients.of_building(session, content.building_id)
        if _is_subscribed(receiver, content) or receiver.id in reached
    ]
    return put_for(session, content, receivers, now)


def is_news(content: MessageContent, last: Message) -> bool:
    """True if a message differs from the last one of its key in what people read."""
    return last.digest != _digest(content)


def put_for(session: Session, content: MessageContent, receivers: Sequence[Receiver], now: datetime) -> Message:
    """Store a message for these recipients, whatever their subscriptions."""
    of_key = (Message.building_id == content.building_id, Message.key == content.key)
    before = session.scalar(select(func.max(Message.number)).where(*of_key))
    message = _message(content, 1 + (before or 0), now)
    message.deliveries = [_delivery(receiver, now) for receiver in receivers]
    if not receivers:
        has_recipients = recipients.of_building(session, content.building_id)
        message.unsent = texts.NO_SUBSCRIBER if has_recipients else texts.NO_RECIPIENTS
    session.add(message)
    session.flush()
    return message


def forward(session: Session, building_id: int, messages: Sequence[Message], now: datetime) -> None:
    """Send messages about open alerts to the subscribed recipients that were added after they were written.

    A recipient whose address has changed since, or that was removed and added again, gets them once more.
    """
    locked(session, building_id)
    for message in messages:
        session.refresh(message, ["deliveries"])
        sent = {one.receiver_id: one for one in message.deliveries}
        for receiver in recipients.of_building(session, building_id):
            before = sent.get(receiver.id)
            if not _is_subscribed(receiver, message):
                continue
            if before is None:
                message.deliveries.append(_delivery(receiver, now))
            elif before.state in ENDED and receiver.since is not None and before.created_at < receiver.since:
                before.state, before.due_at, before.created_at = "waiting", now, now
                before.finished_at, before.tries = None, 0
    session.flush()


def _delivery(receiver: Receiver, now: datetime) -> Delivery:
    return Delivery(receiver_id=receiver.id, state="waiting", due_at=now, created_at=now)


def _message(content: MessageContent, number: int, now: datetime) -> Message:
    event_id, direction = content.picture or (None, None)
    return Message(
        identity=f"msg_{uuid4().hex}",
        building_id=content.building_id,
        key=content.key,
        number=number,
        kind=content.kind,
        sequence=content.sequence,
        severity=content.severity,
        subject=content.subject,
        sentences=list(content.sentences),
        facts=[{"name": name, "value": value} for name, value in content.facts],
        link=content.link,
        picture_event_id=event_id,
        picture_direction=direction,
        data=dict(content.data),
        digest=_digest(content),
        is_over=content.is_over,
        created_at=now,
    )


def _is_subscribed(receiver: Receiver, content: MessageContent | Message) -> bool:
    return content.kind in receiver.kinds and content.severity in receiver.severities


def digest_of(row: Mapping[str, Any]) -> str:
    """The digest of a message by its columns: the stored one, unless other content decided whether it was news."""
    facts = [(one["name"], one["value"]) for one in row["facts"]]
    return _digest_of_read(row["kind"], row["severity"], row["sequence"], row["subject"], row["sentences"], facts)


def _digest(content: MessageContent) -> str:
    """The digest of the content that decides whether a message is news."""
    if content.news is not None:
        return _digest(content.news)
    one = content
    return _digest_of_read(one.kind, one.severity, one.sequence, one.subject, one.sentences, one.facts)


def _digest_of_read(
    kind: str, severity: str, sequence: str, subject: str, sentences: Sequence[str], facts: Sequence[tuple[str, str]]
) -> str:
    """SHA-256 of what people read."""
    order = sequence if sequence in ("cancelled", "repeat") else None
    return hashlib.sha256(orjson.dumps((kind, severity, order, subject, sentences, facts))).hexdigest()
