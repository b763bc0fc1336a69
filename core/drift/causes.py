"""What else than damage could explain what an event, or an alarm, shows?"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import timedelta

import numpy as np

from core.drift.alarm import Alarm
from core.drift.baseline import Baseline
from core.drift.event_value import Deviation, EventNotes
from core.drift.quantities import Quantity
from core.drift.series import SeriesArrays, SeriesEvent
from core.drift.softening import excesses

LARGER = 0.2
"""Natural logarithm by which an event's largest amplitude exceeds the reference's and all before when it is told."""
RECOVERY = timedelta(days=90)
"""In which most of what scragging takes is taken to come back."""
LAYER = ("stiffness", "damping")
MASS = "a change of the building's mass, which scales the force, stiffness and damping of every direction alike"
GAIN = "a gain error of one sensor: of the displacement, or of the accelerations that the force is from"
TEMPERATURE = "the temperature, which was not measured"
SCRAGGING = "the largest event so far: rubber that is stretched farther than before softens, and recovers with time"
AFTER_SCRAGGING = "the largest event so far was less than 90 days before: what rubber lost by it comes back with time"
BEYOND = "amplitudes that the baseline has not seen: the value is not judged"
"""Causes in words."""


def causes_of_events(
    points: SeriesArrays,
    dated: Sequence[SeriesEvent],
    found: Sequence[Deviation],
    baseline: Baseline,
    notes: Sequence[EventNotes],
) -> list[tuple[str, ...]]:
    """Of each event's value, in the order of the events."""
    known = baseline.model.quantity
    edges = np.searchsorted(points.event, np.arange(len(dated)))
    is_cold = known.follows_temperature & np.isnan(points.temperature[edges])
    largest = np.flatnonzero(excesses(points, len(dated), baseline) > LARGER).tolist() if known.softening else []
    every = []
    for n, (when, deviation, note) in enumerate(zip(dated, found, notes, strict=True)):
        recent = [m for m in largest if m < n and when.time - dated[m].time <= RECOVERY]
        causes = [finding.message for finding in note.excluding]
        causes += [BEYOND] if deviation.is_beyond else []
        causes += [TEMPERATURE] if is_cold[n] else []
        causes += [SCRAGGING] if n in largest else [AFTER_SCRAGGING] if recent else []
        every.append(tuple(causes))
    return every


def with_causes(alarm: Alarm, known: Quantity, of_events: Mapping[int, tuple[str, ...]]) -> Alarm:
    """The alarm with everything that could explain its events, and what could explain any such change."""
    always = [MASS, GAIN] if known.name in LAYER else []
    found = [cause for event in alarm.events for cause in of_events[event]]
    return replace(alarm, causes=tuple(dict.fromkeys([*found, *always])))
