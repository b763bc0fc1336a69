"""Tables of what people are told: who they are, the messages, and what became of each on its way."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base
from service.db.encryption import Encrypted


class Receiver(Base):
    """Somebody, or some program, that is told of a building; one that is no longer told stays, with its log."""

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
    """Of notices that it wants."""
    severities: Mapped[list[str]]
    """Of notices that it wants."""
    origin: Mapped[str]
    """`file` (the building's) or `api`."""
    created_by: Mapped[str | None]
    """Name of the key that added it; None for one of the file."""
    created_at: Mapped[datetime]
    removed_at: Mapped[datetime | None]
    since: Mapped[datetime | None]
    """When its address changed last, or it came back; None: it is as it was added."""
    building: Mapped[Building] = relationship()


class Message(Base):
    """What is to be told, as it was when it was put into the outbox; never changed afterwards."""

    __tablename__ = "message"
    __table_args__ = (UniqueConstraint("building_id", "key", "number"), Index(None, "building_id", "id"))
    id: Mapped[int] = mapped_column(primary_key=True)
    identity: Mapped[str] = mapped_column(unique=True)
    """By which receivers know it again: the same in every attempt, at every receiver."""
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    key: Mapped[str]
    """What it is about, such as `event/17`."""
    number: Mapped[int]
    """1 for the first message of the key."""
    kind: Mapped[str]
    sequence: Mapped[str]
    severity: Mapped[str]
    is_over: Mapped[bool]
    """Whether nothing of what it is about stood any more."""
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
    """SHA-256 of what decides whether a later notice is news: of what people read, unless the notice says otherwise."""
    created_at: Mapped[datetime]
    unsent: Mapped[str | None] = mapped_column(Text)
    """Why it went to nobody when it was written; None where it was sent."""
    building: Mapped[Building] = relationship()
    deliveries: Mapped[list["Delivery"]] = relationship(back_populates="message", order_by="Delivery.id")


class Delivery(Base):
    """One message on its way to one receiver; claimed under a lease, its claims count is the fencing token."""

    __tablename__ = "delivery"
    __table_args__ = (UniqueConstraint("message_id", "receiver_id"), Index(None, "state", "due_at"))
    id: Mapped[int] = mapped_column(primary_key=True)
    message_id: Mapped[int] = mapped_column(ForeignKey("message.id"))
    receiver_id: Mapped[int] = mapped_column(ForeignKey("receiver.id"), index=True)
    state: Mapped[str]
    """`waiting`, `sending`, `delivered`, `failed` or `dropped` (its receiver was removed before)."""
    due_at: Mapped[datetime]
    """Before which it is not tried."""
    claims: Mapped[int] = mapped_column(default=0)
    claimed_until: Mapped[datetime | None]
    tries: Mapped[int] = mapped_column(default=0)
    """Attempts since it was put here or replayed."""
    created_at: Mapped[datetime]
    finished_at: Mapped[datetime | None]
    kept_at: Mapped[datetime | None]
    """When it was last repeated at a receiver that forgets what is not repeated."""
    message: Mapped[Message] = relationship(back_populates="deliveries")
    receiver: Mapped[Receiver] = relationship()
    attempts: Mapped[list["DeliveryAttempt"]] = relationship(
        back_populates="delivery", order_by="DeliveryAttempt.number"
    )


class DeliveryAttempt(Base):
    """One attempt to deliver: written before anything is sent, and again when its end is known."""

    __tablename__ = "delivery_attempt"
    __table_args__ = (UniqueConstraint("delivery_id", "number"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    delivery_id: Mapped[int] = mapped_column(ForeignKey("delivery.id"))
    number: Mapped[int]
    """The fencing token of the claim under which it was made."""
    is_repeat: Mapped[bool]
    """Whether it said that it may be the second of its kind."""
    address: Mapped[str] = mapped_column(Text)
    """Where it went, as it may be shown."""
    begun_at: Mapped[datetime]
    outcome: Mapped[str | None]
    """`delivered`, `not_taken`, `unknown` (the receiver may have it); None: under way, or its process died over it."""
    answer: Mapped[str | None] = mapped_column(Text)
    """What the receiver said, or what went wrong."""
    seconds: Mapped[float | None]
    delivery: Mapped[Delivery] = relationship(back_populates="attempts")
