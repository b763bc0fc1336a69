"""Receivers, messages and deliveries, as the API takes and answers them."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from service.buildings.recipient_rules import ReceiverKind, Severity, WantedKind
from service.schema import Answer, Number

Kinds = Annotated[list[WantedKind], Field(min_length=1, max_length=4)]
Severities = Annotated[list[Severity], Field(min_length=1, max_length=4)]
Address = Annotated[str, Field(min_length=1, max_length=2000, pattern=r"^\S+$")]
Secret = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^\S+$")]


class ReceiverRequest(BaseModel):
    """Who shall be told, where, and of what."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: str = Field(
        min_length=1,
        max_length=64,
        pattern=r"^[^\x00-\x1f]+$",
        description="Its own in this building.",
        examples=["manager"],
    )
    kind: ReceiverKind = Field(description="How it is told.", examples=["email"])
    address: Address = Field(
        description="Mail address, web address, or address of Apprise.", examples=["manager@example.org"]
    )
    secret: Secret | None = Field(
        None,
        description="Of a webhook: whsec_ and the base64 of 24 to 64 bytes, which sign what is sent; without it one is "
        "made and answered this once.",
    )
    kinds: Kinds | None = Field(None, description="Of what it is told; null: all, but no event for an alertmanager.")
    severities: Severities | None = Field(None, description="From how grave on is for it to say; null: all.")


class ReceiverChange(BaseModel):
    """What shall be otherwise; what is left out stays as it is."""

    model_config = ConfigDict(extra="forbid", strict=True)

    address: Address | None = Field(None, description="Where it is told from now on.", examples=["other@example.org"])
    secret: Secret | None = Field(None, description="Of a webhook, from now on.")
    kinds: Kinds | None = Field(None, description="Of what it is told from now on.")
    severities: Severities | None = Field(None, description="Severities of which it is told from now on.")


class ReceiverOut(Answer):
    """Who is told of a building; no secret is shown, and of a web address only the server."""

    id: int = Field(description="Its number among all receivers.")
    building: str = Field(description="Code of the building.")
    name: str = Field(description="Its own in this building.")
    kind: str = Field(description="`email`, `webhook`, `alertmanager` or `apprise`.")
    address: str = Field(description="As it may be shown.")
    kinds: list[str] = Field(description="Of what it is told.")
    severities: list[str] = Field(description="Severities of which it is told.")
    origin: str = Field(description="`file` (the building's, and changed there) or `api`.")
    created_by: str | None = Field(description="Name of the key that added it; null of the file's.")
    created_at: datetime = Field(description="When it was told of the building first.")


class ReceiverMade(ReceiverOut):
    """A new receiver."""

    secret: str | None = Field(description="That was made for it: shown now and never again; null where none was.")


class Receivers(Answer):
    """Who is told of a building."""

    items: list[ReceiverOut] = Field(description="The earliest first.")


class FactOut(Answer):
    """Something that a message tells beside its sentences."""

    name: str = Field(description="What it is.")
    value: str = Field(description="With its unit, as people read it.")


class DeliveryRow(Answer):
    """One message on its way to one receiver."""

    id: int = Field(description="Its number among all deliveries.")
    building: str = Field(description="Code of the building.")
    message: int = Field(description="Number of the message.")
    about: str = Field(description="What the message is about, such as `event/17`.")
    kind: str = Field(description="`event`, `alert`, `data`, `drill` or `test`.")
    severity: str = Field(description="`normal`, `note`, `warning` or `alarm`.")
    subject: str = Field(description="Of the message, in one line.")
    receiver: int = Field(description="Number of the receiver.")
    receiver_name: str = Field(description="Its name.")
    receiver_kind: str = Field(description="How it is told.")
    state: str = Field(
        description="`waiting`, `sending`, `delivered`, `failed`, or `dropped`: its receiver was removed before."
    )
    attempts: int = Field(description="How often it was tried.")
    due_at: datetime | None = Field(description="Before which it is not tried again; null unless it waits.")
    last_answer: str | None = Field(description="What came of the last attempt; null before it, and while it lasts.")
    created_at: datetime = Field(description="When the message was put into the outbox.")
    finished_at: datetime | None = Field(description="When it arrived or was given up; null before that.")


class AttemptOut(Answer):
    """One attempt to deliver."""

    number: int = Field(description="From 1 for each delivery.")
    address: str = Field(description="Where it went, as it may be shown.")
    is_repeat: bool = Field(description="Whether it said that it may be the second of its kind.")
    begun_at: datetime = Field(description="When it began.")
    outcome: str | None = Field(
        description="`delivered`, `not_taken`, or `unknown`: the receiver may have it; null while it lasts."
    )
    answer: str | None = Field(description="What the receiver said, or what went wrong; null while it lasts.")
    seconds: Number | None = Field(description="s that it took; null while it lasts, and where its process died.")


class DeliveryOut(DeliveryRow):
    """The same with every attempt."""

    log: list[AttemptOut] = Field(description="The earliest first.")


class Deliveries(Answer):
    """A page of deliveries, the latest first."""

    items: list[DeliveryRow] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class MessageRow(Answer):
    """A message in a list."""

    id: int = Field(description="Its number among all messages.")
    identity: str = Field(description="By which receivers know it again.")
    building: str = Field(description="Code of the building.")
    about: str = Field(description="What it is about, such as `event/17`.")
    number: int = Field(description="From 1 for each thing.")
    kind: str = Field(description="`event`, `alert`, `data`, `drill` or `test`.")
    sequence: str = Field(description="`new`, `updated`, `cancelled` or `repeat`: a reminder.")
    severity: str = Field(description="`normal`, `note`, `warning` or `alarm`.")
    subject: str = Field(description="In one line.")
    created_at: datetime = Field(description="When it was put into the outbox.")
    receivers: int = Field(description="To how many it goes.")
    unsent: str | None = Field(
        description="Why it went to nobody when it was written, such as `no recipients`; null where it was sent."
    )
    delivered: int = Field(description="At how many it has arrived.")
    failed: int = Field(description="At how many it was given up.")


class Messages(Answer):
    """A page of messages, the latest first."""

    items: list[MessageRow] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class MessageOut(MessageRow):
    """A message, whole."""

    sentences: list[str] = Field(description="One paragraph each.")
    facts: list[FactOut] = Field(description="Beside them, in order.")
    link: str = Field(description="Path of the page that has more; empty where there is none.")
    values: dict[str, Any] = Field(description="For programs, in SI units.")
    deliveries: list[DeliveryRow] = Field(description="To whom it goes, and what became of it.")
