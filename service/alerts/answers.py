"""What the API and the pages say of an alert."""

from datetime import datetime

from sqlalchemy.orm import Session

from service.alerts import alert_messages, queries, reminding
from service.alerts.schema import (
    AlertLine,
    AlertOut,
    AlertRow,
    ChangeOut,
    InspectionOut,
    PartOut,
    SilenceOut,
    TellingOut,
)
from service.alerts.silences import silence_of
from service.alerts.states import CLOSED
from service.alerts.tables import Alert, Silence
from service.alerts.telling import tellings


def row(found: Alert) -> AlertLine:
    """An alert as a list has it."""
    same = {name: getattr(found, name) for name in AlertRow.model_fields if name not in ("building", "raised_event")}
    settled = {"state": found.state, "held_by": None} if found.state in CLOSED else {}
    parts = [PartOut(**{**part, **settled}) for part in found.evidence.get("parts", ())]
    return AlertLine(building=found.building.code, raised_event=found.raised_event_id, parts=parts, **same)


def cells(line: AlertLine) -> tuple[object, ...]:
    """The same as a line of CSV: each part as direction, state, change and its 95 % interval."""
    parts = [_part_cell(part) for part in line.parts]
    return tuple((dict(line) | {"parts": parts}).values())


def whole(session: Session, found: Alert, now: datetime) -> AlertOut:
    """An alert with its evidence and history."""
    silence = silence_of(found, queries.silences(session, found.building_id), now)
    return AlertOut(
        **row(found).model_dump(),
        sentences=found.sentences,
        evidence=found.evidence,
        onset_event=found.onset_event_id,
        events=found.event_ids,
        channels=found.channels,
        held_by=found.held_by,
        acknowledgement=found.acknowledgement,
        silenced_until=silence.ends_at if silence else None,
        changes=[ChangeOut.model_validate(change) for change in found.changes],
        inspections=[InspectionOut.model_validate(one) for one in found.inspections],
        told=_told(session, found),
    )


def silence_row(found: Silence) -> SilenceOut:
    """A silence."""
    same = {name: getattr(found, name) for name in SilenceOut.model_fields if name != "building"}
    return SilenceOut(building=found.building.code, **same)


def _part_cell(part: PartOut) -> str:
    sizes = [None if one is None else f"{one:.4g}" for one in (part.drift, part.low, part.high)]
    return f"{part.subject} {part.state} {sizes[0]} ({sizes[1]} to {sizes[2]})"


def _told(session: Session, found: Alert) -> list[TellingOut]:
    """The messages that told of it, those of an event, or its own; then those that reminded of it."""
    key = alert_messages.thread(session, found, tellings(session, found.building_id))
    reminded = [
        line
        for line in queries.tellings(session, found.building_id, reminding.KEY)
        if found.id in {one["id"] for one in line.Message.data["alerts"]}
    ]
    return [
        TellingOut(
            message=message.id,
            written_at=message.created_at,
            sequence=message.sequence,
            subject=message.subject,
            receiver=receiver,
            state=delivery.state if delivery else None,
            finished_at=delivery.finished_at if delivery else None,
            unsent=None if delivery else message.unsent,
        )
        for message, delivery, receiver in (*queries.tellings(session, found.building_id, key), *reminded)
    ]
