"""A section of the building: floors, isolators and sensors with their health, as coordinates of an SVG."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from core.record import Channel
from service.analyses.tables import Analysis
from service.buildings.pages.summary import OF_DATA
from service.records.tables import Event, Waveform
from service.verdict.assessment import ACTIVE
from service.verdict.reading import Standing

STOREY, ISOLATORS, GROUND = 26.0, 22.0, 26.0
"""Units of the drawing: heights of a storey, of the isolators and of the ground."""
LEFT, TOP = 110.0, 20.0
APART, MOST = 18.0, 11
"""Units between two sensors, and sensors that one level has room for."""
UNSEEN, UNCHECKED, WORKS, SUSPECT, SILENT = "no record yet", "not checked yet", "working", "suspect", "silent"


@dataclass(frozen=True, slots=True)
class Sensor:
    """A sensor component with its health."""

    channel: Channel
    state: str
    reason: str
    """Empty where it is working."""
    x: float
    y: float


@dataclass(frozen=True, slots=True)
class Floor:
    """A level above the isolators, or the ground."""

    name: str
    y: float
    sensors: Sequence[Sensor]
    more: int
    """Sensors that the drawing has no room for."""


@dataclass(frozen=True, slots=True)
class Section:
    """A section, ready to be drawn."""

    height: float
    floors: Sequence[Floor]
    """From the roof down to the base slab."""
    ground: Floor
    isolators: Sequence[float]
    """Places of the bearings."""
    level: str
    """Level of the verdict: an open alert counts even if the last earthquake passed every check."""
    sensors: Sequence[Sensor]
    """All of them."""

    @property
    def summary(self) -> str:
        """`10 floors; 13 sensors: 12 working, 1 suspect`."""
        states = [one.state for one in self.sensors]
        counts = [
            f"{states.count(state)} {state}" for state in (WORKS, SUSPECT, SILENT, UNCHECKED, UNSEEN) if state in states
        ]
        return f"{len(self.floors)} levels above the isolators; " + f"{len(states)} sensors: {', '.join(counts)}"


def section(session: Session, standing: Standing) -> Section:
    """The section of a building, with the health of its sensors in the last earthquake."""
    health = _health(session, standing)
    levels = standing.file.description.levels
    sensors: list[Sensor] = []
    floors = []
    bottom = TOP + STOREY * (len(levels) - 2)
    for number, level in enumerate(levels):
        y = bottom + ISOLATORS if number == 0 else bottom - STOREY * (number - 1)
        own = [
            Sensor(one, *health[one.id], x=LEFT + 14 + APART * place, y=y - 9 if number else y + 13)
            for place, one in enumerate(c for c in standing.file.description.channels if c.level == level.name)
        ]
        sensors += own
        floors.append(Floor(level.name, y, own[:MOST], max(0, len(own) - MOST)))
    return Section(
        height=bottom + ISOLATORS + GROUND,
        floors=floors[:0:-1],
        ground=floors[0],
        isolators=[LEFT + 16 + 46 * number for number in range(5)],
        level=standing.verdict.level.value,
        sensors=sensors,
    )


def _health(session: Session, standing: Standing) -> Mapping[str, tuple[str, str]]:
    """(state, reason) of every channel, by the last earthquake and the open alerts about sensors."""
    channels = [one.id for one in standing.file.description.channels]
    if standing.event is None:
        return dict.fromkeys(channels, (UNSEEN, "No earthquake has been recorded yet."))
    last = standing.event.id
    recorded = set(session.scalars(select(Waveform.channel).where(Waveform.event_id == last).distinct()))
    quality = _quality(session, last)
    found = _findings(quality or ())
    alarmed = {
        channel: alert.summary
        for alert in standing.verdict.alerts
        if alert.kind in OF_DATA and alert.state in ACTIVE
        for channel in channels
        if channel in alert.cause
    }
    return {
        one: _state(one, recorded, found.get(one) or alarmed.get(one), is_checked=quality is not None)
        for one in channels
    }


def _state(channel: str, recorded: set[str], problem: str | None, *, is_checked: bool) -> tuple[str, str]:
    if recorded and channel not in recorded:
        return SILENT, problem or "It has no record of the last earthquake."
    if problem:
        return SUSPECT, problem
    if is_checked:
        return WORKS, ""
    if recorded:
        return UNCHECKED, "Its record of the last earthquake is not analysed."
    return UNSEEN, "No record of the last earthquake has arrived yet."


def _quality(session: Session, event: int) -> Sequence[Mapping[str, Any]] | None:
    """Findings of the data quality checks of an event; None as long as it is not analysed."""
    quality = select(Analysis.quality).join(Event, Event.id == Analysis.event_id)
    return session.scalar(quality.where(Event.id == event, Analysis.current))


def _findings(findings: Sequence[Mapping[str, Any]]) -> Mapping[str, str]:
    """First finding of each channel, except notes."""
    return {
        one["channel"]: one["message"] for one in reversed(findings) if one.get("channel") and one["severity"] != "note"
    }
