"""Possible causes of a deviation or an alarm other than a change of the isolation layer, in words for people."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import timedelta

import numpy as np

from core.drift.alarms import Alarm
from core.drift.baseline import Baseline
from core.drift.deviations import Deviation, EventNotes, amplitude_excess
from core.drift.quantities import LAYER_QUANTITIES, Quantity
from core.drift.series import SeriesArrays, SeriesEvent

LARGER = 0.2
"""Natural logarithm of an event's largest amplitude over all before from which on scragging is a possible cause.
A choice: a fifth larger than anything before."""
RECOVERY_TIME = timedelta(days=90)
"""Time in which most softening recovers: three half-lives of `core.drift.deviations`."""
MASS = "a change of the building's mass, which scales the force, stiffness and damping of every direction alike"
"""Cause in words: the mass."""
GAIN = "a gain error of one sensor: of the displacement, or of an acceleration that the force is computed from"
"""Cause in words: a sensor."""
TEMPERATURE = "the temperature, which was not measured"
"""Cause in words: the temperature."""
SCRAGGING = "the largest event so far: rubber that is stretched farther than before softens, and recovers with time"
"""Cause in words: scragging in the event itself."""
AFTER_SCRAGGING = "the largest event so far was less than 90 days before: rubber that softened in it recovers with time"
"""Cause in words: scragging in an earlier event."""
OUT_OF_RANGE = "all amplitudes lie outside the range of the baseline: the rules do not use the value"
"""Cause in words: amplitudes that the baseline does not know."""


def causes_of_events(
    arrays: SeriesArrays,
    events: Sequence[SeriesEvent],
    deviations: Sequence[Deviation],
    baseline: Baseline,
    notes: Sequence[EventNotes],
) -> list[tuple[str, ...]]:
    """Possible causes of the deviation of each event, in the order of the events.

    Args:
        arrays: all measurements of the series.
        events: its n events.
        deviations: n deviations.
        baseline: baseline of the series.
        notes: n notes.
    """
    known = baseline.model.quantity
    edges = np.searchsorted(arrays.event, np.arange(len(events)))
    is_unmeasured = known.follows_temperature & np.isnan(arrays.temperature[edges])
    excess = amplitude_excess(arrays, len(events), baseline) if known.softening else np.zeros(len(events))
    largest = np.flatnonzero(excess > LARGER).tolist()
    every = []
    for n, (when, deviation, note) in enumerate(zip(events, deviations, notes, strict=True)):
        recent = [m for m in largest if m < n and when.time - events[m].time <= RECOVERY_TIME]
        causes = [finding.message for finding in note.excluding]
        causes += [OUT_OF_RANGE] if deviation.is_out_of_range else []
        causes += [TEMPERATURE] if is_unmeasured[n] else []
        causes += [SCRAGGING] if n in largest else [AFTER_SCRAGGING] if recent else []
        every.append(tuple(causes))
    return every


def with_causes(alarm: Alarm, known: Quantity, of_events: Mapping[int, tuple[str, ...]]) -> Alarm:
    """The alarm with the possible causes of its events, and those of any change of the quantity.

    Args:
        alarm: the alarm.
        known: the quantity.
        of_events: causes by event.
    """
    always = [MASS, GAIN] if known.name in LAYER_QUANTITIES else []
    of_alarm = [cause for event in alarm.events for cause in of_events[event]]
    return replace(alarm, causes=tuple(dict.fromkeys([*of_alarm, *always])))
