"""How is a change in a watched series told to somebody who is no engineer?"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime

from core.drift.alarms import Alarm
from core.drift.explanations import Explanation
from core.drift.rules import RECOVERY, SLOW
from core.drift.within_event import WITHIN
from core.rounding import supported
from service.alerts.words import SENSOR_QUANTITIES, listed, of_span, of_subject, of_time

PERCENT, MM = 100.0, 1e3
ACROSS = "residual_displacement"
"""The quantity whose change is a length; those of all others are relative."""


@dataclass(frozen=True, slots=True)
class Telling:
    """What a change of a quantity is, and what it means."""

    less: str
    """One line, with {size} and {subject}."""
    more: str
    meaning: str
    """For everybody, what follows from it and what would do."""


_LOOK = "Somebody who knows isolators ought to look at them."
TELLINGS: Mapping[str, Telling] = {
    "stiffness": Telling(
        "The isolators are {size} softer in {subject}",
        "The isolators are {size} stiffer in {subject}",
        "The isolators carry the building and keep the shaking of the ground away from it; when they change, the "
        f"building will move differently in the next earthquake. {_LOOK}",
    ),
    "damping": Telling(
        "The isolators take up {size} less of the motion in {subject}",
        "The isolators take up {size} more of the motion in {subject}",
        "Dampers and isolators bring the building to rest; with less of it, it moves farther and longer in the next "
        "earthquake. Somebody who knows them ought to look at dampers and isolators.",
    ),
    "frequency": Telling(
        "The building above the isolators vibrates {size} slower in {subject}",
        "The building above the isolators vibrates {size} faster in {subject}",
        "A frame or walls that were damaged are softer and vibrate slower; so does a building that became heavier. "
        "An engineer ought to look for cracks and for new loads.",
    ),
    "residual_displacement": Telling(
        "The isolators come to rest {size} away from where they did, in {subject}",
        "The isolators come to rest {size} away from where they did, in {subject}",
        "After an earthquake the isolators ought to come back to where they were. Their offset, and the gap around the "
        "building, ought to be measured on site.",
    ),
    "gain": Telling(
        "Sensor {subject} reads {size} less than its neighbours tell",
        "Sensor {subject} reads {size} more than its neighbours tell",
        "It may have been replaced or set differently, or it fails. This says nothing of the building, but what is "
        "found with this sensor is not sure until it is checked.",
    ),
    "noise": Telling(
        "Sensor {subject} is {size} less noisy than it was",
        "Sensor {subject} is {size} noisier than it was",
        "It may have a loose cable, or it fails. This says nothing of the building, but small earthquakes are measured "
        "worse until it is checked.",
    ),
    "model_error": Telling(
        "The model of the isolators errs {size} less than it did in {subject}",
        "The model of the isolators errs {size} more than it did in {subject}",
        "The model of the isolators in force no longer tells what they do. An engineer ought to ask what it lacks: "
        "a diagnosis is made for that.",
    ),
}
"""By quantity."""


def summary(quantity: str, subject: str, alarm: Alarm) -> str:
    """One line without an end."""
    telling = TELLINGS[quantity]
    line = telling.less if alarm.drift < 0 else telling.more
    return line.format(size=_size(quantity, alarm), subject=_subject(quantity, subject))


def sentences(
    quantity: str,
    alarm: Alarm,
    earlier: tuple[Alarm, ...],
    told: tuple[Explanation, ...],
) -> tuple[str, ...]:
    """More of it, first for everybody, then for the engineer.

    Args:
        quantity: one of core.drift.quantities.
        alarm: what was found.
        earlier: what the rules had found in the series before.
        told: causes beside the layer and the building, held against every series.
    """
    return tuple(_sentences(quantity, alarm, earlier, told))


def dated(alarm: Alarm, after: datetime, by: datetime) -> str:
    """When it began: between the events of these starts, in the building's time."""
    if alarm.rule == WITHIN:
        return f"It happened within the earthquake of {of_time(by)}."
    shown = "one earthquake shows" if len(alarm.events) == 1 else f"{len(alarm.events)} earthquakes show"
    pace = "It grows little by little; it began" if alarm.rule == SLOW else "It began"
    return f"{pace} between the earthquakes of {of_span(after, by)}; {shown} it."


def _sentences(
    quantity: str,
    alarm: Alarm,
    earlier: tuple[Alarm, ...],
    told: tuple[Explanation, ...],
) -> Iterator[str]:
    if alarm.rule == RECOVERY and earlier:
        yield "After an earlier loss it goes back: this is what a repair does, or rubber that had time to recover."
    else:
        yield TELLINGS[quantity].meaning
    if alarm.causes:
        yield f"What else could explain it: {'; '.join(alarm.causes)}."
    yield f"For the engineer: {alarm.message}."
    if told:
        yield f"Held against everything that is watched: {listed([one.message for one in told])}."
    if earlier:
        yield f"Before that: {listed([one.message for one in earlier])}."
    yield (
        f"The rule ({alarm.rule}) is set so that it errs in {PERCENT * alarm.false_alarms:.2g} % of histories of 100 "
        "earthquakes in a healthy building."
    )


def _size(quantity: str, alarm: Alarm) -> str:
    """The amount to the digit that its interval supports; the words say in which sense."""
    scale, unit = (MM, "mm") if quantity == ACROSS else (PERCENT, "%")
    return supported(scale * abs(alarm.drift), scale * (alarm.high - alarm.low) / 2, unit)


def _subject(quantity: str, subject: str) -> str:
    """A channel stands for itself; a direction or a mode is named."""
    return subject if quantity in SENSOR_QUANTITIES else of_subject(subject)
