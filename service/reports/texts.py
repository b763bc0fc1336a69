"""Words of the reports: symbols that remain readable in grey, and the places to inspect."""

import re
from collections.abc import Mapping

from service.buildings.description import BuildingFile
from service.language.translation import said
from service.verdict.checks import Level, Outcome
from service.verdict.limits import (
    DESIGN,
    DRIFT,
    FLOOR_ACCELERATION,
    INTENSITY,
    LONG_PERIOD,
    MOAT,
    RESIDUAL_OFFSET,
    REST_POSITION,
    STIFFNESS_CHANGE,
    STRAIN,
    STROKE,
    TRAVEL,
)

OUTCOMES: Mapping[Outcome, str] = {Outcome.PASSED: "✓", Outcome.EXCEEDED: "▲", Outcome.UNDECIDED: "?"}
AUTOMATIC = "Automatic, not reviewed by an engineer. It does not replace an inspection."
PROVISIONAL = "PROVISIONAL: {reason}. A later revision replaces this report."
DRILL = "{mark}. This report shows an earlier earthquake. No action is needed."
PLACES: Mapping[str, tuple[str, str]] = {
    STRAIN: ("Isolators", "bulging, cracks, debonding or tilt of the bearings; their bolts and plates; dampers"),
    DESIGN: ("Isolators", "bulging, cracks, debonding or tilt of the bearings; their bolts and plates; dampers"),
    MOAT: ("Moat", "walls, covers, expansion joints; pipes, cables and stairs that cross the isolation layer"),
    STROKE: ("Dampers", "used stroke, leaks, cracks, bolts, remaining deformation"),
    TRAVEL: ("Dampers", "used stroke, leaks, cracks, bolts, remaining deformation"),
    RESIDUAL_OFFSET: ("Position of the building", "offset from the marks; remaining deformation of bearings, dampers"),
    REST_POSITION: ("Position of the building", "offset from the marks; remaining deformation of bearings, dampers"),
    DRIFT: ("Storey", "frames, walls, partitions, facade"),
    FLOOR_ACCELERATION: ("Floor", "ceilings, equipment, tanks, shelves"),
    INTENSITY: ("Isolation layer", "bearings, dampers, moat, crossing pipes, as after any strong shaking"),
    LONG_PERIOD: ("Isolation layer and upper floors", "bearings, dampers; lifts, hanging loads, tall furniture"),
    STIFFNESS_CHANGE: ("Isolators", "bearings and dampers: loose bolts, damage, age, temperature"),
}
"""Place and signs to look for, by the check whose limit is exceeded. General practice, not from a standard."""
WITHOUT_PLACES: Mapping[Level, str] = {
    Level.NO_DATA: "Not known: there is no usable record. Inspect the isolators if the shaking was strong.",
    Level.UNDECIDED: "Not known: an undecided check may hide a limit that is exceeded. Settle the checks, or inspect.",
    Level.WATCH: "No inspection limit is known to be exceeded.",
    Level.NORMAL: "No inspection limit is exceeded.",
}
PLAN = "The inspection plan of the building's designer takes precedence."
NO_CONTACT = "The building file names no contact."
COUNTED = "%(number)s %(words)s"
"""Number of earthquakes of a level."""
BAR = "{title}: {value}, limits {limits}"
"""Summary of a bar, for readers who do not see it."""
CALLED = 2
"""Contacts on a page."""
LONGEST_NAME = 90
"""Characters of a name, which a building file does not limit."""
LONGEST_TEXT = 400
WORD = re.compile(r"([^\s\u3040-\u30ff\u3400-\u9fff\u3000-\u303f\uff00-\uffef]{24})(?=[^\s\u3000-\u9fff\uff00-\uffef])")
"""The beginning of a word that may be longer than a column is wide; between Japanese letters a line may break."""
CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069]+")
"""Control characters, and marks that reverse the direction of the text around them."""


def clipped(text: str, most: int = LONGEST_TEXT) -> str:
    """Text of a person, at most so long, with a possible line break in long words."""
    shown = " ".join(CONTROL.sub(" ", text).split())
    return WORD.sub("\\1\u200b", shown if len(shown) <= most else shown[: most - 1].rstrip() + "…")


def shown(text: str, most: int = LONGEST_TEXT) -> str:
    """A text that the program composed, in the language of the report, at most so long."""
    return clipped(said(text), most)


def contacts(file: BuildingFile) -> str:
    """The first people to call, with their numbers."""
    named = (", ".join(filter(None, (one.name, one.role, one.phone, one.mail))) for one in file.contacts[:CALLED])
    return clipped("; ".join(named)) or said(NO_CONTACT)


def listed(items: list[str], most: int) -> tuple[str, ...]:
    """The first of some sentences, and how many more there are."""
    if len(items) <= most:
        return tuple(items)
    return (*items[: most - 1], said(f"… and {len(items) - most + 1} more, listed on the page of the earthquake."))
