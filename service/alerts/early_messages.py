"""Early messages: an earthquake that a live stream shows while it shakes, before anything is analysed.

They are of the event's thread, so that the message with the result is an update of them.
"""

from datetime import UTC
from typing import TYPE_CHECKING
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from core.rounding import significant
from service.alerts import queries, texts
from service.alerts.message_facts import event_key
from service.buildings.description import BuildingFile
from service.buildings.tables import Building
from service.notify import outbox
from service.notify.outbox import MessageContent
from service.notify.tables import Message
from service.records.tables import Event

if TYPE_CHECKING:  # it imports ObsPy, which the worker does not need
    from service.records.streams.earthquakes import Shaking

GAL = 1e2
NEWS = 2.0
"""Ratio of the largest acceleration to that of the last message from which there is another one. Not tuned."""


def write(session: Session, building: Building, described: BuildingFile, event: Event, shaking: "Shaking") -> None:
    """Put a message about an earthquake that is not over into the outbox, unless the last one says nearly the same."""
    before = queries.messages(session, building.id, event_key(event.id))
    if before and not (is_early(before[-1]) and shaking.largest >= NEWS * before[-1].data["largest_acceleration"]):
        return
    outbox.put(session, _content(building, described, event, shaking, is_first=not before), event.updated_at)


def is_early(message: Message) -> bool:
    """True for a message that was written while it shook."""
    return bool(message.data.get("is_provisional", False))


def _content(
    building: Building, described: BuildingFile, event: Event, shaking: "Shaking", *, is_first: bool
) -> MessageContent:
    levels = _largest_by_level(described, shaking)
    level, largest = max(levels.items(), key=lambda item: item[1])
    local = event.start.astimezone(ZoneInfo(described.timezone))
    values = {
        "name": building.name,
        "when": texts.local_time(local),
        "peak": significant(largest * GAL),
        "level": level,
    }
    return MessageContent(
        key=event_key(event.id),
        building_id=building.id,
        kind="event",
        sequence="new" if is_first else "updated",
        severity="note",
        subject=texts.EARLY_SUBJECT.format(**values),
        sentences=(texts.EARLY.format(**values), texts.EARLY_PROVISIONAL),
        facts=tuple(
            (texts.FACT_EARLY.format(level=name), f"{significant(one * GAL)} gal") for name, one in levels.items()
        ),
        link=f"/events/{event.id}",
        data={
            "building": building.code,
            "event": event.id,
            "start": event.start.astimezone(UTC).isoformat(),
            "end": None,
            "refusal": None,
            "is_provisional": True,
            "largest_acceleration": shaking.largest,
            "largest_accelerations": dict(shaking.peaks),
            "alerts": [],
        },
    )


def _largest_by_level(described: BuildingFile, shaking: "Shaking") -> dict[str, float]:
    """m/s², by name of the level, from the ground up."""
    levels: dict[str, float] = {}
    for level in described.description.levels:
        channels = [one.id for one in described.description.channels if one.level == level.name]
        if there := [shaking.peaks[one] for one in channels if one in shaking.peaks]:
            levels[level.name] = max(there)
    return levels
