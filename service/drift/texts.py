"""The texts of alerts about a change in a monitored series, or an exceeded limit, for readers who are not engineers."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime

from core.drift.alarms import Alarm
from core.drift.explanations import Explanation
from core.drift.quantities import SENSOR_QUANTITIES
from core.drift.rules import RECOVERY, SLOW
from core.drift.within_event import WITHIN
from core.rounding import supported
from service.alerts.texts import listed, local_time, subject as alert_subject, time_span
from service.verdict.checks import Level

PERCENT, MM = 100.0, 1e3
ACROSS = "residual_displacement"
"""The quantity whose change is a length; all others are relative."""


@dataclass(frozen=True, slots=True)
class ChangeText:
    """The summary of a change of a quantity, and its meaning."""

    less: str
    """One line, with {size} and {subject}."""
    more: str
    meaning: str
    """For everybody: consequences and recommended action."""


CHANGES: Mapping[str, ChangeText] = {
    "stiffness": ChangeText(
        "The isolators are {size} softer in {subject}",
        "The isolators are {size} stiffer in {subject}",
        "The isolators carry the building and keep the shaking of the ground away from it; when they change, the "
        "building will move differently in the next earthquake. Have them inspected by a specialist.",
    ),
    "damping": ChangeText(
        "The damping of the isolators is {size} lower in {subject}",
        "The damping of the isolators is {size} higher in {subject}",
        "Dampers and isolators bring the building to rest; with less damping it moves farther and longer in the next "
        "earthquake. Have dampers and isolators inspected by a specialist.",
    ),
    "frequency": ChangeText(
        "The building above the isolators vibrates {size} slower in {subject}",
        "The building above the isolators vibrates {size} faster in {subject}",
        "Damaged frames and walls are softer and vibrate slower; so does a building that has become heavier. An "
        "engineer should look for cracks and for new loads.",
    ),
    ACROSS: ChangeText(
        "The isolators come to rest {size} away from their earlier position, in {subject}",
        "The isolators come to rest {size} away from their earlier position, in {subject}",
        "After an earthquake the isolators should return to their earlier position. Have their offset and the gap "
        "around the building measured on site.",
    ),
    "gain": ChangeText(
        "Sensor {subject} reads {size} less than its neighbours suggest",
        "Sensor {subject} reads {size} more than its neighbours suggest",
        "It may have been replaced or set differently, or it is failing. The building is not affected, but results "
        "from this sensor are uncertain until it is checked.",
    ),
    "noise": ChangeText(
        "Sensor {subject} is {size} less noisy than it was",
        "Sensor {subject} is {size} noisier than it was",
        "It may have a loose cable, or it is failing. The building is not affected, but small earthquakes are measured "
        "less accurately until it is checked.",
    ),
    "model_error": ChangeText(
        "The error of the isolators' model is {size} smaller than it was in {subject}",
        "The error of the isolators' model is {size} larger than it was in {subject}",
        "The isolators' model in use no longer describes their behaviour. An engineer should run a diagnosis, which "
        "shows what the model lacks.",
    ),
}
"""By quantity."""
NAMES: Mapping[str, str] = {
    "stiffness": "stiffness",
    "damping": "damping",
    "frequency": "frequency",
    "gain": "gain",
    "noise": "noise",
    "residual_displacement": "residual displacement",
    "model_error": "model error",
}
"""Short names, by quantity."""
RETURNS = "It returns after an earlier loss, as after a repair or when the rubber has had time to recover."
OTHER_CAUSES = "Other possible explanations: {causes}."
FOR_THE_ENGINEER = "For the engineer: {message}."
COMPARED = "Compared with all monitored quantities: {messages}."
EARLIER = "Before that: {messages}."
FALSE_ALARMS = (
    "The rule ({rule}) raises a false alarm in {percent:.2g} % of histories of 100 earthquakes in a healthy building."
)
WITHIN_EVENT = "It happened within the earthquake of {when}."
BEGAN = "It began between the earthquakes of {span}; {shown} it."
BEGAN_SLOWLY = "It is growing gradually; it began between the earthquakes of {span}; {shown} it."
ONE_SHOWS = "one earthquake shows"
SEVERAL_SHOW = "{count} earthquakes show"

BEYOND_LIMIT: Mapping[Level, str] = {
    Level.ACT: "beyond the action limit",
    Level.INSPECT: "beyond the inspection limit",
}
LIMIT_UNCLEAR = "perhaps beyond the action limit"
"""Ends of the sentence about a check: `Floor acceleration: 320 gal, beyond the inspection limit`."""
LIMIT_EVENT = "This was in the earthquake of {when}. The alert stays until an inspection is recorded on its page."


def summary(quantity: str, subject: str, alarm: Alarm) -> str:
    """One line without a full stop."""
    change = CHANGES[quantity]
    line = change.less if alarm.drift < 0 else change.more
    named = subject if quantity in SENSOR_QUANTITIES else alert_subject(subject)
    return line.format(size=_size(quantity, alarm), subject=named)


def sentences(
    quantity: str, alarm: Alarm, earlier: tuple[Alarm, ...], compared: tuple[Explanation, ...]
) -> tuple[str, ...]:
    """Details, first for everybody, then for the engineer.

    Args:
        quantity: one of core.drift.quantities.
        alarm: the change.
        earlier: sure alarms of the series before it.
        compared: explanations beside the layer and the building, compared with every series.
    """
    return tuple(_sentences(quantity, alarm, earlier, compared))


def dated(alarm: Alarm, after: datetime, by: datetime) -> str:
    """When it began: between the events of these starts, in the building's time."""
    if alarm.rule == WITHIN:
        return WITHIN_EVENT.format(when=local_time(by))
    count = len(alarm.events)
    shown = ONE_SHOWS if count == 1 else SEVERAL_SHOW.format(count=count)
    return (BEGAN_SLOWLY if alarm.rule == SLOW else BEGAN).format(span=time_span(after, by), shown=shown)


def _sentences(
    quantity: str, alarm: Alarm, earlier: tuple[Alarm, ...], compared: tuple[Explanation, ...]
) -> Iterator[str]:
    yield RETURNS if alarm.rule == RECOVERY and earlier else CHANGES[quantity].meaning
    if alarm.causes:
        yield OTHER_CAUSES.format(causes="; ".join(alarm.causes))
    yield FOR_THE_ENGINEER.format(message=alarm.message)
    if compared:
        yield COMPARED.format(messages=listed([one.message for one in compared]))
    if earlier:
        yield EARLIER.format(messages=listed([one.message for one in earlier]))
    yield FALSE_ALARMS.format(rule=alarm.rule, percent=PERCENT * alarm.false_alarms)


def _size(quantity: str, alarm: Alarm) -> str:
    """The amount, rounded to the digit that its interval supports; the summary says in which direction."""
    scale, unit = (MM, "mm") if quantity == ACROSS else (PERCENT, "%")
    return supported(scale * abs(alarm.drift), scale * (alarm.high - alarm.low) / 2, unit)
