"""Sentences of the models' room that people read: refusals, progress, changes, findings, titles and captions."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime

COMPARISON_TITLE = "{}: the model against the records"
DIAGNOSIS_TITLE = "{}: what the model lacks"
DIAGNOSIS_FIGURES = (
    "The pictures are of the model as it was given, its values fitted; the last two also with what was added."
)
NOT_FITTED = "held"
"""In place of a standard deviation."""

FIGURES: Mapping[str, tuple[str, str]] = {
    "stiffness": (
        "Stiffness correction over amplitude",
        "Each point is a block of 5 s: its correction of the model's stiffness, with its standard deviation. A correct "
        "model's points scatter about zero at every amplitude. A trend with amplitude shows a missing law or a wrong "
        "yield force. An offset between earthquakes shows a change between them: past motion, temperature, a step.",
    ),
    "yield": (
        "Yield correction over travel",
        "Correction of the model's yield force by each block in which the layer yields, over the layer's total travel. "
        "Heating lowers the yield force during an earthquake, and it recovers before the next; after degradation it "
        "does not recover.",
    ),
    "candidates": (
        "Effects that would reduce the error",
        "Remaining error with each effect that the model does not have, added alone and the whole model refitted. "
        "Dashed: no effect added, {before:.3g}; grey line: noise alone. Orange: the best effect, and those that the "
        "records cannot distinguish from it. Effects at the dashed line do not help.",
    ),
    "motion": (
        "Residual over displacement and velocity",
        "Mean of what the model leaves (measured − model) where displacement and velocity were so, each earthquake to "
        "its own scale. Bands along the velocity are a damping law that is not linear, ends along the displacement an "
        "elastic one, a turn between the quadrants a hysteresis.",
    ),
    "where": (
        "Where the excess error lies",
        "Bars: share of the excess error, with its 95 % interval; grey ticks: share of the force's energy, where an "
        "error in proportion to the force would lie. A bar far above its tick is where the model fails.",
    ),
    "spectrum": (
        "Residual spectrum",
        "What the model leaves over frequency, each earthquake in multiples of its own noise. Above the noise about "
        "the frequency of the motion: the layer's law; far above it: impact, stick-slip or the superstructure.",
    ),
    "loop": (
        "Loop of the strongest earthquake",
        "The earthquake of {name}, the one of the largest displacement. Residual: measured "
        "− model. Where its ends turn up: hardening or a moat wall; ends unlike each other: an asymmetry; steps at the "
        "reversals: friction, or another yield; a loop of its own: damping that is missing.",
    ),
    "histories": (
        "Measured and modelled",
        "The earthquake of {name}, the one of the largest displacement: the force, driven by the measured motion"
        "{predicted}.",
    ),
}
"""Title and caption of every figure, by its key."""
PREDICTED = "; below, the displacement that model and superstructure predict from the ground motion alone"

COMPARING = "Holding the model against every event"
COMPARING_GIVEN = "Holding the model as it was against every event"
COMPARING_MADE = "Holding the new one against every event"
FITTING = "Fitting the model"
DIAGNOSING = "Asking every effect what it would explain"
BY_DESIGN, BY_VALUES = "by the design values", "by values that were given"
"""Reason for a first model."""
NOT_COMPARABLE = (
    "none of these events has the isolation layer's motion and force in the model's direction; events that "
    "were analysed, at a building with a transducer or accelerometers on both sides of the layer, are needed"
)
ALL_HELD_OUT = "Every event is held out; leave at least one to fit."


def reading(earthquake: str) -> str:
    """Progress of reading records."""
    return f"reading the earthquake of {earthquake}"


def reading_event(name: str) -> str:
    """Progress of reading a stored event."""
    return f"Reading {name}"


def fitting_with(effect: str) -> str:
    """Progress of an addition."""
    return f"{FITTING} with {effect}"


def fitted_to(fitted: int, held_out: int) -> str:
    """Change of a version by a fit."""
    return f"fitted to {fitted} event{'s' if fitted > 1 else ''}" + (f", {held_out} held out" if held_out else "")


def held_out_twice(earthquake: str) -> str:
    """Refusal of records that are both fitted and held out."""
    return f"the earthquake of {earthquake} is held out, and also among the others; give it once"


def not_measured(code: str, missing: Sequence[str], measured: Sequence[str]) -> str:
    """Refusal of a model in a direction that the building does not measure."""
    return (
        f"{code} does not measure direction {' and '.join(missing)}; it measures {' and '.join(measured) or 'neither'}"
    )


def no_model(reason: object) -> str:
    """Refusal of values."""
    return f"The values make no model: {reason}."


def unknown_effect(name: str, known: Collection[str]) -> str:
    """Refusal of an effect that does not exist."""
    return f"There is no effect {name!r}; there are {', '.join(sorted(known))}."


def has_effect(name: str) -> str:
    """Refusal of an effect that the model has."""
    return f"The model has {name} already; a fit determines its values."


def both_fitted_and_held_out(events: Collection[int]) -> str:
    """Refusal of events that are both."""
    return f"Events {', '.join(map(str, events))} are both held out and fitted; choose one."


def events_not_comparable(events: Collection[int], direction: str) -> str:
    """Refusal of events that a model cannot be compared with."""
    return (
        f"With events {', '.join(map(str, events))} a model of direction {direction} cannot be compared: "
        "they are not this building's, or their analyses have no displacement of the isolation layer in it."
    )


def no_event_comparable(direction: str) -> str:
    """Refusal of work before the first event."""
    return (
        f"No event can be compared with a model of direction {direction} yet: one that was analysed and "
        "has the isolation layer's displacement is needed."
    )


def missed(latest: int, start: datetime, direction: str, excess: float, allowed: float | None) -> str:
    """Finding on a model that misses the latest events.

    Args:
        latest: how many in a row.
        start: of the last one.
        direction: of its largest error.
        excess: error beyond noise, as a share of the force's RMS.
        allowed: the usual limit of the same.
    """
    events = "event" if latest == 1 else f"{latest} events"
    return (
        f"The model misses the latest {events}: in the event of {start:%Y-%m-%d %H:%M:%S} UTC, direction "
        f"{direction}, {excess:.1%} of the force is neither the model's nor noise; up to "
        f"{allowed:.1%} would be as in the events it was fitted to. A diagnosis shows what is missing."
    )
