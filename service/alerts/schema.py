"""Alerts and silences as the API and the pages show them, and the requests about them."""

from collections.abc import Iterable, Mapping
from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, WithJsonSchema
from sqlalchemy.orm import Session

from service.alerts import queries, texts
from service.alerts.lifecycle import CLOSED
from service.alerts.message_content import REMINDER_KEY
from service.alerts.message_facts import message_key, reports_by_alert, silence_of
from service.alerts.tables import Alert, BuildingInspection, Silence
from service.schema import Answer, Number, Page
from service.times import read_time
from service.verdict.assessment import Result

Time = Annotated[
    datetime,
    BeforeValidator(read_time),
    WithJsonSchema({"type": "string", "format": "date-time", "examples": ["2024-05-01T00:00:00Z"]}),
]
SAYING = r"^[^\x00]*\S[^\x00]*$"
"""A text that says something, without NUL, which PostgreSQL cannot store."""
Note = Annotated[str, Field(min_length=1, max_length=2000, pattern=SAYING)]
PersonName = Annotated[str, Field(min_length=1, max_length=100, pattern=SAYING)]


class AlertRow(Answer):
    """An alert in a list."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    cause: str = Field(description="Its subject, such as `stiffness` or `source`.")
    kind: str = Field(description="`deterioration`, `limit`, `recovery`, `sensor`, `model` or `data`.")
    state: str = Field(
        description="`pending` (under review), `on_hold` (another alert may explain it), `active`, `acknowledged`, "
        "`resolved` or `withdrawn` (it was wrong)."
    )
    summary: str = Field(description="One line for readers who are not engineers.")
    began_at: datetime = Field(description="Its most likely beginning: the start of that event.")
    changed_after: datetime | None = Field(
        description="Start of the last event that did not show it; null for a periodic check."
    )
    changed_by: datetime | None = Field(
        description="Start of the first event that did; it began between the two with 95 % confidence. "
        "Null for a periodic check."
    )
    opened_at: datetime = Field(description="Time when it was opened.")
    activated_at: datetime | None = Field(description="Time when the evidence sufficed; null before.")
    acknowledged_at: datetime | None = Field(description="Time when it was acknowledged; null before.")
    acknowledged_by: str | None = Field(description="Person who acknowledged it; null before.")
    assigned_to: str | None = Field(description="Person who looks after it; null where no one was named.")
    closed_at: datetime | None = Field(description="Time when it was resolved or withdrawn; null while it is open.")
    raised_event: int | None = Field(description="Number of the event that raised it; null for a periodic check.")


class PartOut(Answer):
    """The part of an alert in one direction of the isolation layer, or in the mean of both."""

    subject: str = Field(description="`x`, `y`, or `xy`: both directions on average.")
    state: str = Field(
        description="`active`, `pending` or `on_hold`, by the last evidence; after the end of the alert, its state."
    )
    held_by: str | None = Field(description="Cause of the alert that may explain it; null if there is none.")
    rule: str | None = Field(description="`sudden`, `slow`, `recovery` or `within` (one event).")
    drift: Number | None = Field(description="Relative: -0.08 for 8 % less; m for `residual_displacement`.")
    low: Number | None = Field(description="Lower end of its 95 % interval.")
    high: Number | None = Field(description="Upper end of its 95 % interval.")
    began_at: datetime = Field(description="Start of the event with which it most likely began.")
    changed_after: datetime | None = Field(description="Start of the last event that did not show it.")
    changed_by: datetime | None = Field(description="Start of the first event that did.")
    events: list[int] = Field(description="Numbers of the events that show it.")
    summary: str = Field(description="One line for readers who are not engineers.")


class AlertLine(AlertRow):
    """An alert in a list, with its parts."""

    parts: list[PartOut] = Field(
        description="Directions of the isolation layer; in CSV each as direction, state, change and interval."
    )

    @classmethod
    def cells(cls, row: Mapping[str, Any]) -> Iterable[object]:
        """A row in CSV, with each part as direction, state, change and its 95 % interval."""
        return {**row, "parts": [_part_cell(part) for part in row["parts"]]}.values()


class Alerts(Page[AlertLine]):
    """A page of alerts, the latest first."""


class ChangeOut(Answer):
    """A change of an alert's state."""

    at: datetime = Field(description="Time of the change.")
    state: str = Field(description="State after the change.")
    by: str | None = Field(description="Person who made it; null for the service itself.")
    note: str = Field(description="Why.")
    summary: str = Field(description="Summary at that time.")
    evidence: dict[str, Any] = Field(description="Evidence at that time.")


class CommentOut(Answer):
    """A comment on an alert, or its assignment to a person."""

    at: datetime = Field(description="Time when it was written.")
    by: str = Field(description="Person who wrote it.")
    text: str = Field(description="The comment; empty of an assignment without one.")
    assigned_to: str | None = Field(description="Person to whom it was assigned; null of a comment alone.")


class InspectionOut(Answer):
    """An inspection of the building, or a review of the data, that ended an alert."""

    id: int = Field(description="Its number.")
    at: datetime = Field(description="Time when it was recorded.")
    by: str = Field(description="Person who recorded it.")
    outcome: str = Field(description="`confirmed`, or `unfounded`: the alert was wrong.")
    note: str = Field(description="Findings and work done.")
    reference_from: datetime | None = Field(
        description="Start of the new reference period; null if the reference period stays."
    )


class AlertMessageOut(Answer):
    """A message about an alert, and its delivery to one recipient."""

    message: int = Field(description="Number of the message.")
    written_at: datetime = Field(description="Time when it was written.")
    sequence: str = Field(description="`new`, `updated`, `cancelled` or `repeat`.")
    subject: str = Field(description="Subject line.")
    receiver: str | None = Field(description="Name of the recipient; null if it was not sent.")
    state: str | None = Field(
        description="`waiting`, `sending`, `delivered`, `failed` or `dropped`; null without a recipient."
    )
    finished_at: datetime | None = Field(description="Time when it arrived or failed for good; null before.")
    unsent: str | None = Field(description="Why it was not sent, such as `no recipients`; null if it was sent.")


class AlertOut(AlertLine):
    """An alert with its evidence and history."""

    sentences: list[str] = Field(description="Details, first for everybody, then for the engineer.")
    evidence: dict[str, Any] = Field(description="Evidence, SI units.")
    onset_event: int | None = Field(description="Number of the first event that shows it; null for a periodic check.")
    events: list[int] = Field(description="Numbers of the events that triggered it.")
    channels: list[str] = Field(description="Channels that it was measured with.")
    held_by: str | None = Field(description="Cause of the alert that keeps it on hold; null if there is none.")
    acknowledgement: str | None = Field(description="Note of the acknowledgement; null before.")
    silenced_until: datetime | None = Field(description="End of the silence that applies to it; null if there is none.")
    changes: list[ChangeOut] = Field(description="Every change of its state, the earliest first.")
    inspections: list[InspectionOut] = Field(description="Inspections, the earliest first.")
    comments: list[CommentOut] = Field(description="Comments and assignments, the earliest first.")
    messages: list[AlertMessageOut] = Field(description="Messages about it and their deliveries.")


AS_BEFORE, FROM_NOW, SINCE_IT_BEGAN = "as_before", "from_now", "since_it_began"
"""Choices of the reference period after an inspection."""
YEARS = range(1950, 2200)
"""Years in which an inspection may have been made: its time can be converted to any zone."""
LONGEST = 24 * 365
"""h that a silence may last."""


def _reference(choice: str) -> str:
    if choice not in (AS_BEFORE, FROM_NOW, SINCE_IT_BEGAN):
        raise ValueError(texts.UNKNOWN_REFERENCE)
    return choice


def _hours(typed: str) -> int:
    if not (typed.isascii() and typed.isdigit() and 0 < int(typed[:6]) <= LONGEST):
        raise ValueError(texts.HOURS_OF_SILENCE.format(most=LONGEST))
    return int(typed)


def _typed_time(typed: str) -> datetime:
    try:
        time = datetime.fromisoformat(typed[:16])
    except ValueError:
        time = None
    if time is None or time.year not in YEARS:
        raise ValueError(texts.NO_SUCH_TIME.format(typed=typed))
    return time


class RequestBody(BaseModel):
    """A request about an alert."""

    model_config = ConfigDict(extra="forbid")


class AcknowledgeRequest(RequestBody):
    """Acknowledgement of an alert."""

    note: Note = Field(description="Action that is being taken.", examples=["On my way to the building."])
    name: PersonName | None = Field(
        None, description="Name of the person, where several share a key.", examples=["A. Engineer"]
    )


class CommentRequest(RequestBody):
    """Comment on an alert."""

    text: Note = Field(description="The comment.", examples=["Waiting for the maker's answer."])
    name: PersonName | None = Field(
        None, description="Name of the person, where several share a key.", examples=["A. Engineer"]
    )


class AssignRequest(RequestBody):
    """Assignment of an alert to a person."""

    to: PersonName = Field(description="Person who looks after it from now on.", examples=["A. Engineer"])
    text: Note | None = Field(None, description="A comment.", examples=["Please look at it this week."])
    name: PersonName | None = Field(
        None, description="Name of the sender, where several share a key.", examples=["A. Engineer"]
    )


class Inspected(RequestBody):
    """Result of an inspection."""

    outcome: Literal["confirmed", "unfounded"] = Field(
        description="`confirmed`, or `unfounded`: the alert was wrong.", examples=["confirmed"]
    )
    note: Note = Field(description="Findings and work done.", examples=["Bearings 3 and 4 were replaced."])
    name: PersonName | None = Field(
        None, description="Name of the person, where several share a key.", examples=["A. Engineer"]
    )


class InspectRequest(Inspected):
    """Inspection that ends an alert."""

    reference_from: Time | None = Field(
        None, description="Start of a new reference period; without it the reference period stays."
    )


class InspectForm(Inspected):
    """The same by the form of the page."""

    reference: Annotated[str, AfterValidator(_reference)] = AS_BEFORE


class Silenced(RequestBody):
    """Alerts of a building to silence."""

    pattern: str = Field(
        description="Pattern of causes, with * for any text and ? for any character; `*` matches all.",
        min_length=1,
        max_length=100,
        pattern=r"^[!-~]+$",
        examples=["stiffness/*"],
    )
    reason: Note = Field(description="Why.", examples=["A load test."])


class SilenceRequest(Silenced):
    """Silence for some alerts of a building."""

    until: Time = Field(description="Time when it ends.")


class SilenceForm(Silenced):
    """The same by the form of the page."""

    hours: Annotated[int, BeforeValidator(_hours)]


class BuildingInspected(RequestBody):
    """Inspection of a building."""

    result: Result = Field(
        description="`fit` (for normal use), `restricted` (its comment says how) or `unfit` (not for use).",
        examples=["fit"],
    )
    comment: Note = Field(
        description="Findings, restrictions, work done.", examples=["All 24 bearings seen; no cracks."]
    )
    name: PersonName | None = Field(
        None, description="Name of the person, where several share a key.", examples=["A. Engineer"]
    )


class BuildingInspectionRequest(BuildingInspected):
    """Inspection of a building, signed by the sender."""

    inspected_at: Time | None = Field(
        None, description="Time when it was made; without it, now. It covers earthquakes that ended before."
    )


class BuildingInspectionForm(BuildingInspected):
    """The same by the form of the page, with the time of the building's clock."""

    inspected_at: Annotated[datetime, BeforeValidator(_typed_time)]


class BuildingInspectionOut(Answer):
    """An inspection of a building."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    inspected_at: datetime = Field(description="Time when it was made.")
    recorded_at: datetime = Field(description="Time when it was recorded.")
    by: str = Field(description="Person who signed it.")
    result: str = Field(description="`fit` (for normal use), `restricted` or `unfit`.")
    comment: str = Field(description="Findings, restrictions, work done.")
    level: str = Field(description="Automatic level when it was recorded.")
    headline: str = Field(description="Verdict when it was recorded, one line.")


class BuildingInspections(Answer):
    """Inspections of a building, the latest first."""

    items: list[BuildingInspectionOut] = Field(description="All of them.")
    next: str | None = Field(description="Always null: they are all on one page.")


class SilenceOut(Answer):
    """A time during which no messages about some alerts are sent."""

    id: int = Field(description="Its number.")
    building: str = Field(description="Code of the building.")
    pattern: str = Field(description="Pattern of causes.")
    starts_at: datetime = Field(description="Time when it began.")
    ends_at: datetime = Field(description="Time when it ends, or was ended.")
    reason: str = Field(description="Why.")
    by: str = Field(description="Person who set it.")
    ended_by: str | None = Field(description="Person who ended it early; null if it was not ended early.")


class Silences(Answer):
    """Silences of a building, the latest first."""

    items: list[SilenceOut] = Field(description="All of them.")
    next: str | None = Field(description="Always null: they are all on one page.")


def alert_line(alert: Alert) -> AlertLine:
    """An alert in a list."""
    same = {name: getattr(alert, name) for name in AlertRow.model_fields if name not in ("building", "raised_event")}
    settled = {"state": alert.state, "held_by": None} if alert.state in CLOSED else {}
    parts = [PartOut(**{**part, **settled}) for part in alert.evidence.get("parts", ())]
    return AlertLine(building=alert.building.code, raised_event=alert.raised_event_id, parts=parts, **same)


def alert_out(session: Session, alert: Alert, now: datetime) -> AlertOut:
    """An alert with its evidence and history."""
    silence = silence_of(alert, queries.silences(session, alert.building_id), now)
    return AlertOut(
        **alert_line(alert).model_dump(),
        sentences=alert.sentences,
        evidence=alert.evidence,
        onset_event=alert.onset_event_id,
        events=alert.event_ids,
        channels=alert.channels,
        held_by=alert.held_by,
        acknowledgement=alert.acknowledgement,
        silenced_until=silence.ends_at if silence else None,
        changes=[ChangeOut.model_validate(change) for change in alert.changes],
        inspections=[InspectionOut.model_validate(one) for one in alert.inspections],
        comments=[CommentOut.model_validate(one) for one in alert.comments],
        messages=_messages(session, alert),
    )


def inspection_out(row: BuildingInspection, code: str) -> BuildingInspectionOut:
    """An inspection of the building of that code."""
    same = {name: getattr(row, name) for name in BuildingInspectionOut.model_fields if name != "building"}
    return BuildingInspectionOut(building=code, **same)


def silence_out(silence: Silence) -> SilenceOut:
    """A silence."""
    same = {name: getattr(silence, name) for name in SilenceOut.model_fields if name != "building"}
    return SilenceOut(building=silence.building.code, **same)


def _part_cell(part: Mapping[str, Any]) -> str:
    drift, low, high = [None if part[one] is None else f"{part[one]:.4g}" for one in ("drift", "low", "high")]
    return f"{part['subject']} {part['state']} {drift} ({low} to {high})"


def _messages(session: Session, alert: Alert) -> list[AlertMessageOut]:
    """The messages that report an alert, those of its event or its own, then the reminders of it."""
    key = message_key(session, alert, reports_by_alert(session, alert.building_id))
    reminders = [
        line
        for line in queries.deliveries(session, alert.building_id, REMINDER_KEY)
        if alert.id in {one["id"] for one in line.Message.data["alerts"]}
    ]
    return [
        AlertMessageOut(
            message=message.id,
            written_at=message.created_at,
            sequence=message.sequence,
            subject=message.subject,
            receiver=recipient,
            state=delivery.state if delivery else None,
            finished_at=delivery.finished_at if delivery else None,
            unsent=None if delivery else message.unsent,
        )
        for message, delivery, recipient in (*queries.deliveries(session, alert.building_id, key), *reminders)
    ]
