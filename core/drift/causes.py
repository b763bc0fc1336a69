"""Possible causes of a deviation or an alarm other than a change of the isolation layer, in words for people."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import timedelta

import numpy as np

from core.arrays import Indices, Mask
from core.drift.alarms import Alarm
from core.drift.baseline import Baseline
from core.drift.deviations import EventNotes, EventSummaries, amplitude_excess
from core.drift.quantities import LAYER_QUANTITIES, Quantity

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


@dataclass(frozen=True, slots=True, eq=False)
class EventCauses:
    """Possible causes of the deviation of each event of a series."""

    summaries: EventSummaries
    notes: Mapping[int, EventNotes]
    """By event."""
    is_unmeasured: Mask
    """(n,) whether the temperature matters and was not measured."""
    largest: Indices
    """(earthquakes,) indices of the events that were larger than all before."""

    def of(self, place: int) -> tuple[str, ...]:
        """Causes of the event at an index."""
        time = self.summaries.time
        before = self.largest[self.largest < place]
        is_recent = bool((time[place] - time[before] <= RECOVERY_TIME.total_seconds()).any())
        note = self.notes.get(int(self.summaries.event[place]))
        causes = [finding.message for finding in note.excluding] if note is not None else []
        causes += [OUT_OF_RANGE] if self.summaries.is_out_of_range[place] else []
        causes += [TEMPERATURE] if self.is_unmeasured[place] else []
        causes += [SCRAGGING] if place in self.largest else [AFTER_SCRAGGING] if is_recent else []
        return tuple(causes)


def causes_of_events(summaries: EventSummaries, baseline: Baseline, notes: Mapping[int, EventNotes]) -> EventCauses:
    """Possible causes of the deviations of a series.

    Args:
        summaries: the events of the series.
        baseline: baseline of the series.
        notes: notes by event.
    """
    known = baseline.model.quantity
    is_unmeasured = np.asarray(known.follows_temperature & ~summaries.has_temperature)
    excess = amplitude_excess(summaries.peak, baseline) if known.softening else np.zeros(summaries.event.size)
    return EventCauses(summaries, dict(notes), is_unmeasured, np.flatnonzero(excess > LARGER))


def with_causes(alarm: Alarm, known: Quantity, of_event: Callable[[int], tuple[str, ...]]) -> Alarm:
    """The alarm with the possible causes of its events, and those of any change of the quantity.

    Args:
        alarm: the alarm.
        known: the quantity.
        of_event: causes of the event with an identifier.
    """
    always = [MASS, GAIN] if known.name in LAYER_QUANTITIES else []
    of_alarm = [cause for event in alarm.events for cause in of_event(event)]
    return replace(alarm, causes=tuple(dict.fromkeys([*of_alarm, *always])))
