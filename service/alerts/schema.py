"""Alerts, silences and the audit trail, as the API answers them, and what may be asked of them."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema

from service.schema import Answer, Number
from service.times import read_time

Given = Annotated[
    datetime,
    BeforeValidator(read_time),
    WithJsonSchema({"type": "string", "format": "date-time", "examples": ["2024-05-01T00:00:00Z"]}),
]
Note = Annotated[str, Field(min_length=1, max_length=2000, pattern=r"\S")]
PersonName = Annotated[str, Field(min_length=1, max_length=100, pattern=r"\S")]


class AlertRow(Answer):
    """An alert in a list."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    cause: str = Field(description="What it is about, such as `stiffness` or `source`.")
    kind: str = Field(description="`deterioration`, `recovery`, `sensor`, `model` or `data`.")
    state: str = Field(
        description="`pending` (under review), `on_hold` (another alert may explain it), `active`, `acknowledged`, "
        "`resolved` or `withdrawn` (it never was so)."
    )
    summary: str = Field(description="One line for somebody who is no engineer.")
    began_at: datetime = Field(description="Since when it is so, as it seems: the start of the likeliest event.")
    changed_after: datetime | None = Field(
        description="Start of the last event that did not show it; null where the clock found it."
    )
    changed_by: datetime | None = Field(
        description="Start of the first event that did; with 95 % it began between. Null where the clock found it."
    )
    opened_at: datetime = Field(description="When it was found first.")
    activated_at: datetime | None = Field(description="When there was evidence enough; null before.")
    acknowledged_at: datetime | None = Field(description="When somebody took it on; null before.")
    acknowledged_by: str | None = Field(description="Who took it on; null before.")
    closed_at: datetime | None = Field(description="When it was resolved or withdrawn; null while it is open.")
    raised_event: int | None = Field(description="Number of the event that raised it; null where the clock did.")


class PartOut(Answer):
    """What one direction of a layer, or the mean of both, shows of an alert."""

    subject: str = Field(description="`x`, `y`, or `xy`: both directions on average.")
    state: str = Field(
        description="`active`, `pending` or `on_hold`, as it was found last; after its end that of the alert."
    )
    held_by: str | None = Field(description="Cause of the alert that may explain it; null where none does.")
    rule: str | None = Field(description="`sudden`, `slow`, `recovery` or `within` (one event).")
    drift: Number | None = Field(description="Relative, -0.08 for 8 % less; of `residual_displacement` m.")
    low: Number | None = Field(description="Lower end of its 95 % interval.")
    high: Number | None = Field(description="Upper end of it.")
    began_at: datetime = Field(description="Start of the event with which it most likely began.")
    changed_after: datetime | None = Field(description="Start of the last event that did not show it.")
    changed_by: datetime | None = Field(description="Start of the first event that did.")
    events: list[int] = Field(description="Numbers of the events that show it.")
    summary: str = Field(description="One line for somebody who is no engineer.")


class AlertLine(AlertRow):
    """An alert in a list, with its parts."""

    parts: list[PartOut] = Field(
        description="Directions of the layer; in CSV each as direction, state, change and interval."
    )


class Alerts(Answer):
    """A page of alerts, the latest first."""

    items: list[AlertLine] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class ChangeOut(Answer):
    """A change of an alert's state."""

    at: datetime = Field(description="When.")
    state: str = Field(description="Its state from then on.")
    by: str | None = Field(description="Who did it; null where the service itself did.")
    note: str = Field(description="Why.")
    summary: str = Field(description="What it said then.")
    evidence: dict[str, Any] = Field(description="What was known then.")


class InspectionOut(Answer):
    """What somebody found at the building."""

    id: int = Field(description="Its number.")
    at: datetime = Field(description="When it was told.")
    by: str = Field(description="Who told it.")
    outcome: str = Field(description="`confirmed`, or `unfounded`: it never was so.")
    note: str = Field(description="What was found, and done.")
    reference_from: datetime | None = Field(
        description="From when on the building counts as healthy again; null where that stays as it was."
    )


class TellingOut(Answer):
    """A message about an alert, and how far it came at one receiver."""

    message: int = Field(description="Number of the message.")
    written_at: datetime = Field(description="When it was written.")
    sequence: str = Field(description="`new`, `updated`, `cancelled` or `repeat`.")
    subject: str = Field(description="Its subject.")
    receiver: str | None = Field(description="Name of the receiver; null where it was not sent.")
    state: str | None = Field(
        description="`waiting`, `sending`, `delivered`, `failed` or `dropped`; null without a receiver."
    )
    finished_at: datetime | None = Field(description="When it arrived or was given up; null before.")
    unsent: str | None = Field(description="Why it went to nobody, such as `no recipients`; null where it was sent.")


class AlertOut(AlertLine):
    """An alert with its evidence and history."""

    sentences: list[str] = Field(description="More of it, first for everybody, then for the engineer.")
    evidence: dict[str, Any] = Field(description="What it rests on, SI units.")
    onset_event: int | None = Field(
        description="Number of the first event that shows it; null where the clock found it."
    )
    events: list[int] = Field(description="Numbers of the events that triggered it.")
    channels: list[str] = Field(description="Channels that it was found with.")
    held_by: str | None = Field(description="Cause of the alert that holds it back; null where none does.")
    acknowledgement: str | None = Field(description="Note of who took it on; null before.")
    silenced_until: datetime | None = Field(description="Until when nobody is told of it; null where people are.")
    changes: list[ChangeOut] = Field(description="Every change of its state, the earliest first.")
    inspections: list[InspectionOut] = Field(description="What people found.")
    told: list[TellingOut] = Field(description="Who was told, and whether it arrived.")


class Asked(BaseModel):
    """What somebody asks of an alert."""

    model_config = ConfigDict(extra="forbid")


class AcknowledgeRequest(Asked):
    """Somebody takes an alert on."""

    note: Note = Field(description="What is being done about it.", examples=["On my way to the building."])
    name: PersonName | None = Field(
        None, description="Name of the person, where several share a key.", examples=["A. Engineer"]
    )


class InspectRequest(Asked):
    """Somebody ends an alert by what was found."""

    outcome: Literal["confirmed", "unfounded"] = Field(
        description="`confirmed`, or `unfounded`: it never was so.", examples=["confirmed"]
    )
    note: Note = Field(description="What was found, and done.", examples=["Bearings 3 and 4 were replaced."])
    name: PersonName | None = Field(
        None, description="Name of the person, where several share a key.", examples=["A. Engineer"]
    )
    reference_from: Given | None = Field(
        None, description="From when on the building counts as healthy again; without it that stays as it was."
    )


class SilenceRequest(Asked):
    """Nobody is to be told of some alerts for a while."""

    pattern: str = Field(
        description="Of causes, with * for any text and ? for any character; `*` is all.",
        min_length=1,
        max_length=100,
        pattern=r"^[!-~]+$",
        examples=["stiffness/*"],
    )
    until: Given = Field(description="When it ends.")
    reason: Note = Field(description="Why.", examples=["A load test."])


class SilenceOut(Answer):
    """A time during which nobody is told of some alerts."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    pattern: str = Field(description="Of causes.")
    starts_at: datetime = Field(description="When it began.")
    ends_at: datetime = Field(description="When it ends, or was ended.")
    reason: str = Field(description="Why.")
    by: str = Field(description="Who wished it.")
    ended_by: str | None = Field(description="Who ended it before its time; null where nobody did.")


class Silences(Answer):
    """Silences of a building, the latest first."""

    items: list[SilenceOut] = Field(description="All of them.")
    next: str | None = Field(description="Always null: they are all on one page.")


class AuditRow(Answer):
    """Something that a person changed."""

    id: int = Field(description="Its number.")
    at: datetime = Field(description="When.")
    by: str = Field(description="Name of the key, or of the account that gave the command.")
    address: str = Field(description="From where: an address, or the name of the machine.")
    action: str = Field(description="Method of the request, or the command.")
    target: str = Field(description="Path of the request; empty for a command.")
    details: dict[str, Any] = Field(description="What was asked for, without secrets.")


class Audit(Answer):
    """A page of the audit trail, the latest first."""

    items: list[AuditRow] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")
