"""Tables of recipients, messages, and the deliveries of each message."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base
from service.db.encryption import Encrypted
from service.language.choice import ENGLISH


class Receiver(Base):
    """A person or a program that receives messages about a building; a removed one stays, with its log."""

    __tablename__ = "receiver"
    __table_args__ = (UniqueConstraint("building_id", "name"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    name: Mapped[str]
    kind: Mapped[str]
    """`email`, `webhook`, `alertmanager` or `apprise`."""
    address: Mapped[str] = mapped_column(Encrypted)
    """As given: it may hold a password or a token, or name a variable of the environment (`env:NAME`)."""
    secret: Mapped[str | None] = mapped_column(Encrypted)
    """Key of the signature, or the variable that holds it; never shown again."""
    kinds: Mapped[list[str]]
    """Subscribed to these."""
    severities: Mapped[list[str]]
    """Subscribed to these."""
    with_report: Mapped[bool] = mapped_column(default=False)
    """True if mails about earthquakes carry the report as PDF."""
    language: Mapped[str] = mapped_column(default=ENGLISH)
    """In which a person gets messages and the report: `en` or `ja`."""
    origin: Mapped[str]
    """`file` (the building's) or `api`."""
    created_by: Mapped[str | None]
    """Name of the key that added it; None for one of the building file."""
    created_at: Mapped[datetime]
    removed_at: Mapped[datetime | None]
    since: Mapped[datetime | None]
    """Time when its address last changed, or it was added again; None: neither has happened."""
    building: Mapped[Building] = relationship()


class Message(Base):
    """A message as it was put into the outbox; never changed afterwards."""

    __tablename__ = "message"
    __table_args__ = (UniqueConstraint("building_id", "key", "number"), Index(None, "building_id", "id"))
    id: Mapped[int] = mapped_column(primary_key=True)
    identity: Mapped[str] = mapped_column(unique=True)
    """Its identity for recipients: the same in every attempt, for every recipient."""
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    key: Mapped[str]
    """Its subject, such as `event/17`."""
    number: Mapped[int]
    """1 for the first message of the key."""
    kind: Mapped[str]
    sequence: Mapped[str]
    severity: Mapped[str]
    is_over: Mapped[bool]
    """True if what it reports had ended."""
    subject: Mapped[str] = mapped_column(Text)
    sentences: Mapped[list[str]]
    facts: Mapped[list[dict[str, Any]]]
    """Each with `name` and `value`, in order."""
    link: Mapped[str] = mapped_column(Text)
    picture_event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"))
    picture_direction: Mapped[str | None]
    data: Mapped[dict[str, Any]]
    """For programs, SI units."""
    digest: Mapped[str]
    """SHA-256 of the content that decides whether a later message is news."""
    created_at: Mapped[datetime]
    unsent: Mapped[str | None] = mapped_column(Text)
    """Reason why it was not sent at first; None if it was sent."""
    building: Mapped[Building] = relationship()
    deliveries: Mapped[list["Delivery"]] = relationship(back_populates="message", order_by="Delivery.id")


class Delivery(Base):
    """Delivery of one message to one recipient; claimed under a lease, with the number of claims as fencing token."""

    __tablename__ = "delivery"
    __table_args__ = (UniqueConstraint("message_id", "receiver_id"), Index(None, "state", "due_at"))
    id: Mapped[int] = mapped_column(primary_key=True)
    message_id: Mapped[int] = mapped_column(ForeignKey("message.id"))
    receiver_id: Mapped[int] = mapped_column(ForeignKey("receiver.id"), index=True)
    state: Mapped[str]
    """`waiting`, `sending`, `delivered`, `failed` or `dropped` (its recipient was removed before)."""
    due_at: Mapped[datetime]
    """Earliest time of the next attempt."""
    claims: Mapped[int] = mapped_column(default=0)
    claimed_until: Mapped[datetime | None]
    tries: Mapped[int] = mapped_column(default=0)
    """Attempts since it was put into the outbox or replayed."""
    created_at: Mapped[datetime]
    finished_at: Mapped[datetime | None]
    kept_at: Mapped[datetime | None]
    """Time of the last repetition to an Alertmanager, which drops alerts that are not repeated."""
    message: Mapped[Message] = relationship(back_populates="deliveries")
    receiver: Mapped[Receiver] = relationship()
    attempts: Mapped[list["DeliveryAttempt"]] = relationship(
        back_populates="delivery", order_by="DeliveryAttempt.number"
    )


class DeliveryAttempt(Base):
    """One attempt to deliver: stored before anything is sent, and completed with its result."""

    __tablename__ = "delivery_attempt"
    __table_args__ = (UniqueConstraint("delivery_id", "number"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    delivery_id: Mapped[int] = mapped_column(ForeignKey("delivery.id"))
    number: Mapped[int]
    """The fencing token of the claim under which it was made."""
    is_repeat: Mapped[bool]
    """True if the message said that it may be the second one."""
    address: Mapped[str] = mapped_column(Text)
    """Address, without secrets."""
    begun_at: Mapped[datetime]
    outcome: Mapped[str | None]
    """`delivered`, `not_taken`, `unknown` (the recipient may have it); None: under way, or its process died."""
    answer: Mapped[str | None] = mapped_column(Text)
    """Answer of the recipient, or the error."""
    seconds: Mapped[float | None]
    delivery: Mapped[Delivery] = relationship(back_populates="attempts")
