"""Recipients, messages and deliveries as the API and the pages show them, and the requests about them."""

from collections.abc import Sequence
from datetime import datetime
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, model_validator
from sqlalchemy.orm import Session

from service.access.roles import Caller, Role
from service.buildings.recipient_rules import ReceiverKind, Severity, WantedKind, shown_address
from service.http.forms import ticked
from service.language.choice import ENGLISH, Language
from service.notify import queries
from service.notify.tables import Delivery, DeliveryAttempt, Message, Receiver
from service.notify.texts import HIDDEN
from service.schema import Answer, Number, Page

Kinds = Annotated[list[WantedKind], Field(min_length=1, max_length=4)]
Severities = Annotated[list[Severity], Field(min_length=1, max_length=4)]
Address = Annotated[str, Field(min_length=1, max_length=2000, pattern=r"^\S+$")]
Secret = Annotated[str, Field(min_length=1, max_length=200, pattern=r"^\S+$")]


class ReceiverRequest(BaseModel):
    """A recipient to add: its address and its subscriptions."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: str = Field(
        min_length=1,
        max_length=64,
        pattern=r"^[^\x00-\x1f]+$",
        description="Unique in this building.",
        examples=["manager"],
    )
    kind: ReceiverKind = Field(description="Kind of recipient.", examples=["email"])
    address: Address = Field(description="Mail address, web address, or Apprise URL.", examples=["manager@example.org"])
    secret: Secret | None = Field(
        None,
        description="For a webhook: whsec_ and the base64 of the 24 to 64 bytes that sign messages; without it one is "
        "made and returned this once.",
    )
    kinds: Kinds | None = Field(None, description="Kinds of messages; null: all, except events for an alertmanager.")
    severities: Severities | None = Field(None, description="Severities of messages; null: all.")
    report: bool = Field(
        False, description="For a mail address: true to get the report on an earthquake, as PDF, with its messages."
    )
    language: Language = Field(
        ENGLISH,
        description="Language of its messages and the report: `en` or `ja`; a webhook or an alertmanager gets `en`.",
    )


class ReceiverForm(ReceiverRequest):
    """The same by the form of the page, where kinds and severities are boxes."""

    @model_validator(mode="before")
    @classmethod
    def _boxes(cls, fields: dict[str, object]) -> dict[str, object]:
        lists = {name: ticked(fields, f"{name}_") for name in ("kinds", "severities")}
        texts = {name: one for name, one in fields.items() if not name.startswith(("kinds_", "severities_"))}
        boxes: dict[str, object] = {"report": True} if "report" in fields else {}
        return texts | boxes | {name: one for name, one in lists.items() if one}


class ReceiverChange(BaseModel):
    """Changes of a recipient; omitted values stay as they are."""

    model_config = ConfigDict(extra="forbid", strict=True)

    address: Address | None = Field(None, description="New address.", examples=["other@example.org"])
    secret: Secret | None = Field(None, description="New secret of a webhook.")
    kinds: Kinds | None = Field(None, description="New kinds of messages.")
    severities: Severities | None = Field(None, description="New severities of messages.")
    report: bool | None = Field(None, description="Whether mails about earthquakes carry the report as PDF.")
    language: Language | None = Field(None, description="New language of its messages and the report.")


class ReceiverOut(Answer):
    """A recipient of a building's messages; secrets are not shown, and of a web address only the server."""

    id: int = Field(description="Its number among all recipients.")
    building: str = Field(description="Code of the building.")
    name: str = Field(description="Unique in this building.")
    kind: str = Field(description="`email`, `webhook`, `alertmanager` or `apprise`.")
    address: str = Field(description="Address, without secrets.")
    kinds: list[str] = Field(description="Kinds of messages.")
    severities: list[str] = Field(description="Severities of messages.")
    report: bool = Field(description="True if mails about earthquakes carry the report as PDF.")
    language: str = Field(description="Language of its messages and the report: `en` or `ja`.")
    origin: str = Field(description="`file` (the building's, and changed there) or `api`.")
    created_by: str | None = Field(description="Name of the key that added it; null for one of the building file.")
    created_at: datetime = Field(description="Time when it was added.")


class ReceiverMade(ReceiverOut):
    """A new recipient."""

    secret: str | None = Field(description="Secret that was made for it: shown now and never again; null if none was.")


class Receivers(Answer):
    """Recipients of a building's messages."""

    items: list[ReceiverOut] = Field(description="The earliest first.")


class FactOut(Answer):
    """A fact of a message, beside its sentences."""

    name: str = Field(description="Name of the fact.")
    value: str = Field(description="Value with its unit.")


class DeliveryRow(Answer):
    """Delivery of one message to one recipient."""

    id: int = Field(description="Its number among all deliveries.")
    building: str = Field(description="Code of the building.")
    message: int = Field(description="Number of the message.")
    about: str = Field(description="Subject of the message, such as `event/17`.")
    kind: str = Field(description="`event`, `alert`, `data`, `drill` or `test`.")
    severity: str = Field(description="`normal`, `note`, `warning` or `alarm`.")
    subject: str = Field(description="Subject line of the message.")
    receiver: int = Field(description="Number of the recipient.")
    receiver_name: str = Field(description="Name of the recipient.")
    receiver_kind: str = Field(description="Kind of recipient.")
    state: str = Field(
        description="`waiting`, `sending`, `delivered`, `failed`, or `dropped`: its recipient was removed before."
    )
    attempts: int = Field(description="Number of attempts.")
    due_at: datetime | None = Field(description="Time of the next attempt; null unless it waits.")
    last_answer: str | None = Field(description="Answer to the last attempt; null before and during it.")
    created_at: datetime = Field(description="Time when the message was put into the outbox.")
    finished_at: datetime | None = Field(description="Time when it arrived or failed for good; null before.")


class AttemptOut(Answer):
    """One attempt to deliver."""

    number: int = Field(description="From 1 for each delivery.")
    address: str = Field(description="Address, without secrets.")
    is_repeat: bool = Field(description="True if the message said that it may be the second one.")
    begun_at: datetime = Field(description="Time when it began.")
    outcome: str | None = Field(
        description="`delivered`, `not_taken`, or `unknown`: the recipient may have it; null while it lasts."
    )
    answer: str | None = Field(description="Answer of the recipient, or the error; null while it lasts.")
    seconds: Number | None = Field(description="Duration, s; null while it lasts, and if its process died.")


class DeliveryOut(DeliveryRow):
    """A delivery with every attempt."""

    log: list[AttemptOut] = Field(description="The earliest first.")


class Deliveries(Page[DeliveryRow]):
    """A page of deliveries, the latest first."""


class MessageRow(Answer):
    """A message in a list."""

    id: int = Field(description="Its number among all messages.")
    identity: str = Field(description="Identity, the same for every recipient and in every attempt.")
    building: str = Field(description="Code of the building.")
    about: str = Field(description="Its subject, such as `event/17`.")
    number: int = Field(description="From 1 for each subject.")
    kind: str = Field(description="`event`, `alert`, `data`, `drill` or `test`.")
    sequence: str = Field(description="`new`, `updated`, `cancelled` or `repeat`: a reminder.")
    severity: str = Field(description="`normal`, `note`, `warning` or `alarm`.")
    subject: str = Field(description="Subject line.")
    created_at: datetime = Field(description="Time when it was put into the outbox.")
    receivers: int = Field(description="Number of recipients.")
    unsent: str | None = Field(
        description="Why it was not sent when it was written, such as `no recipients`; null if it was sent."
    )
    delivered: int = Field(description="Number of recipients that have it.")
    failed: int = Field(description="Number of recipients at which it failed for good.")


class Messages(Page[MessageRow]):
    """A page of messages, the latest first."""


class MessageOut(MessageRow):
    """A message with its sentences, facts and deliveries."""

    sentences: list[str] = Field(description="One paragraph each.")
    facts: list[FactOut] = Field(description="Facts beside the sentences, in order.")
    link: str = Field(description="Path of the page with the details; empty if there is none.")
    values: dict[str, Any] = Field(description="For programs, in SI units.")
    deliveries: list[DeliveryRow] = Field(description="Its deliveries.")


Shown = TypeVar("Shown", ReceiverOut, MessageOut, DeliveryRow, DeliveryOut)


def visible_to(by: Caller, answer: Shown) -> Shown:
    """The same as a caller may see it: viewers of its building see neither recipients' addresses nor their answers."""
    if by.on(answer.building).role >= Role.engineer:
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
        hidden["deliveries"] = [visible_to(by, one) for one in answer.deliveries]
    return answer.model_copy(update=hidden)


def receiver_out(row: Receiver) -> ReceiverOut:
    """A recipient, without secrets."""
    return ReceiverOut(
        id=row.id,
        building=row.building.code,
        name=row.name,
        kind=row.kind,
        address=shown_address(row.kind, row.address),
        kinds=row.kinds,
        severities=row.severities,
        report=row.with_report,
        language=row.language,
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


def message_out(session: Session, row: Message) -> MessageOut:
    """A message with its sentences, facts and deliveries."""
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


def delivery_out(row: Delivery) -> DeliveryOut:
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
