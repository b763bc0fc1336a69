"""Sentences of the models' room that people read: refusals, progress, changes, findings, titles and captions."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime

from core.rounding import significant
from core.units import percent

COMPARISON_TITLE = "{}: the model against the records"
FORECAST_TITLE = "{}: response to given ground motions"
LIMITS_CAPTION = "Limits of the building"
LIMITS_NOTE = (
    "Share: forecast over the limit, with the upper end of its 95 % interval. Undecided: the limit lies within the "
    "interval, the motion is out of range, or a direction is not forecast."
)
DIAGNOSIS_TITLE = "{}: what the model lacks"
IMPROVEMENT_TITLE = "Improvement: {}"
SKETCH_TITLE = "{}: sketch of the force that the model lacks"
DIAGNOSIS_FIGURES = (
    "The figures show the given model with its values fitted; the last two also show it with the added effects."
)
NOT_FITTED = "fixed"
"""In place of a standard deviation."""

ROBUST_AXIS = (
    "The axis ends {fence:g} interquartile ranges beyond the quartiles, because these points would flatten all others; "
    "bars are cut there."
)
FIRST_DIAGNOSIS = "First diagnosis"
FIGURES: Mapping[str, tuple[str, str]] = {
    "left_out": (
        "Error in earthquakes left out",
        "Error of the force, root mean square over that of the force, after each change: in each earthquake by the "
        "model fitted to the others, and (orange) in stronger earthquakes by the model fitted to weaker ones. An "
        "effect is added if the orange line falls.",
    ),
    "stiffness": (
        "Stiffness correction over amplitude",
        "Each point is the correction of the model's stiffness in a block of 5 s, with its standard deviation. With a "
        "correct model the points scatter about zero at every amplitude. A trend with amplitude shows a missing law or "
        "a wrong yield force. An offset between earthquakes shows a change between them: past motion, temperature, a "
        "step of the stiffness.",
    ),
    "yield": (
        "Yield correction over travel",
        "Correction of the model's yield force in each block in which the layer yields, over the total travel of the "
        "layer. After heating, the yield force recovers before the next earthquake; after degradation it does not.",
    ),
    "candidates": (
        "Effects that would reduce the error",
        "Remaining error with each effect that the model lacks, added alone and the whole model fitted again. Dashed "
        "line: without another effect, {before:.3g}; grey line: noise alone. Orange: the best effect, and those that "
        "the records cannot distinguish from it. Effects at the dashed line do not help.",
    ),
    "motion": (
        "Residual over displacement and velocity",
        "Mean residual (measured − model) over displacement and velocity, each earthquake on its own scale. Bands "
        "along the velocity axis show nonlinear damping, residuals at the ends of the displacement axis nonlinear "
        "elasticity, a rotation through the quadrants hysteresis.",
    ),
    "where": (
        "Where the excess error lies",
        "Bars: share of the excess error, with its 95 % interval. Grey ticks: share of the force's energy, where an "
        "error in proportion to the force would lie. The model fails where a bar is far above its tick.",
    ),
    "spectrum": (
        "Residual spectrum",
        "Residual over frequency, each earthquake in multiples of its own noise. An excess near the frequency of the "
        "motion points to the law of the layer; far above it, to impact, stick-slip or the superstructure.",
    ),
    "loop": (
        "Loop of the strongest earthquake",
        "The earthquake of {name}, which has the largest displacement. Residual: measured − model. Ends that turn up "
        "show hardening or contact with the moat wall; unequal ends, an asymmetry; steps at the reversals, friction "
        "or another yield; a loop of the residual itself, missing damping.",
    ),
    "forecast_displacement": (
        "Displacement of the isolators",
        "Response to the ground motion, with two standard deviations by the covariance of the model's values. The "
        "intervals of the peaks are wider: they contain the model's own error too.",
    ),
    "forecast_accelerations": (
        "Accelerations of the levels",
        "Largest absolute acceleration of each level, with its 95 % interval: the covariance of the model's values, "
        "and the model's own error in the records.",
    ),
    "sketch_force": (
        "The missing force over what it depends on",
        "What is measured beyond the model, and its mean with two standard deviations (band), over the displacement by "
        "the direction of the motion; dashed: the proposed law.",
    ),
    "sketch_law": (
        "Measured against the law",
        "What is measured beyond the rest of the model, over the force of the proposed law. If the law is right, the "
        "points lie along the dashed line, including those of held-out earthquakes.",
    ),
    "histories": (
        "Measured and modelled",
        "The earthquake of {name}, which has the largest displacement: the force, driven by the measured motion"
        "{predicted}.",
    ),
}
"""Title and caption of every figure, by its key."""
PREDICTED = "; below, the displacement that the model and the superstructure predict from the ground motion alone"

COMPARING = "Comparing the model with every event"
COMPARING_GIVEN = "Comparing the former version with every event"
COMPARING_MADE = "Comparing the new version with every event"
FITTING = "Fitting the model"
DIAGNOSING = "Testing every effect"
IMPROVING = "Improving the model"
FORECASTING = "Forecasting the response"
SKETCHING = "Sketching the missing force"
MOST_NAMED = 5
"""Models that a refusal names."""
ONE_SCALING = "scale to one thing: pga, displacement or design_spectrum"
NO_DESIGN_SPECTRUM = "The building file has no [design_spectrum]; add it, or scale to something else."
BY_DESIGN, BY_VALUES = "from the design values", "from given values"
"""Reason for a first model."""
NOT_COMPARABLE = (
    "none of these events has the motion and the force of the isolation layer in the model's direction; analysed "
    "events of a building with a transducer, or with accelerometers on both sides of the layer, are needed"
)
ONE_EVENT = "event"
"""The latest one."""
ALL_HELD_OUT = "Every event is held out; keep at least one to fit."


def outside_axis(values: Sequence[float], total: int, name: str) -> str:
    """Remark on points that an axis does not reach.

    Args:
        values: theirs, one at least.
        total: points in all.
        name: of the values, with their unit in parentheses.
    """
    unit = name.partition("(")[2].rstrip(")")
    ends = [significant(end) for end in dict.fromkeys((min(values), max(values)))]
    where = f"at {ends[0]} {unit}" if len(ends) == 1 else f"from {ends[0]} to {ends[1]} {unit}"
    verb = "lies outside the axis, a triangle" if len(values) == 1 else "lie outside the axis, triangles"
    return f"{len(values)} of {total} points {verb} at its edge: {where}."


def reading(earthquake: str) -> str:
    """Progress of reading records."""
    return f"reading the earthquake of {earthquake}"


def reading_event(name: str) -> str:
    """Progress of reading a stored event."""
    return f"Reading {name}"


def fitting_with(effect: str) -> str:
    """Progress of an addition."""
    return f"Fitting the model with {effect}"


def fitted_to(fitted: int, held_out: int, added: str | None = None) -> str:
    """Change of a version by a fit, with an effect that was added before if one is given."""
    events = "event" if fitted == 1 else "events"
    if added is None:
        return f"fitted to {fitted} {events}, {held_out} held out" if held_out else f"fitted to {fitted} {events}"
    if held_out:
        return f"with {added}, fitted to {fitted} {events}, {held_out} held out"
    return f"with {added}, fitted to {fitted} {events}"


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
    return f"These values do not make a model: {reason}."


def unknown_effect(name: str, known: Collection[str]) -> str:
    """Refusal of an effect that does not exist."""
    return f"There is no effect {name!r}; there are {', '.join(sorted(known))}."


def taken_name(name: str) -> str:
    """Refusal of a name for a sketched effect."""
    return f"An effect cannot be called {name!r}: choose an unused name of letters, digits and _, no digit first."


NOTHING_PROPOSED = "The sketch proposes no law that could be kept."
SKETCHED_EARLIER = "An earlier version made this sketch and did not store its law as values; sketch again."


FILE_GONE = "The uploaded file is no longer stored; send it again."
UPLOADED = "Reading the ground motion"
NO_MOTION = "choose an earthquake, or a file of a ground motion"


def too_many_files(most: int) -> str:
    """Refusal of an upload."""
    return f"A ground motion has at most {most} files; send fewer, or one ZIP archive."


def unknown_term(name: str, problem: str) -> str:
    """Refusal of a kept effect that another version of Menshin kept."""
    return f"This version of Menshin cannot write the effect {name!r}: {problem}."


def effect_in_use(name: str, models: Sequence[int]) -> str:
    """Refusal to delete a kept effect that models have."""
    more = f" and {len(models) - MOST_NAMED} more" if len(models) > MOST_NAMED else ""
    return f"The effect {name!r} is part of models {', '.join(map(str, models[:MOST_NAMED]))}{more}; they need it."


def effect_wanted(name: str, job: int) -> str:
    """Refusal to delete a kept effect that work under way may give to a model."""
    return f"Job {job} may give the effect {name!r} to a model; delete it once that job has ended."


def has_effect(name: str) -> str:
    """Refusal of an effect that the model has."""
    return f"The model has {name} already; a fit determines its values."


def both_fitted_and_held_out(events: Collection[int]) -> str:
    """Refusal of events that are both."""
    return f"Events {', '.join(map(str, events))} are both held out and fitted; choose one."


def events_not_comparable(events: Collection[int], direction: str) -> str:
    """Refusal of events that a model cannot be compared with."""
    return (
        f"A model of direction {direction} cannot be compared with events {', '.join(map(str, events))}: they belong "
        "to another building, or their analyses have no displacement of the isolation layer in this direction."
    )


def not_analysed(event: int) -> str:
    """Refusal of an event without a result."""
    return f"Event {event} has no analysis, so its ground motion is not known."


def no_ground_motion(name: str) -> str:
    """Refusal of an event as a ground motion."""
    return f"the earthquake of {name} has no usable record of the ground's horizontal acceleration; choose another one"


def no_event_comparable(direction: str) -> str:
    """Refusal of work before the first event."""
    return (
        f"No event can be compared with a model of direction {direction} yet: an analysed event with the displacement "
        "of the isolation layer is needed."
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
    events = ONE_EVENT if latest == 1 else f"{latest} events"
    limit = "" if allowed is None else f"; the limit, from the events it was fitted to, is {percent(allowed)}"
    return (
        f"The model misses the latest {events}: in the event of {start:%Y-%m-%d %H:%M:%S} UTC, direction {direction}, "
        f"{percent(excess)} of the force is explained neither by the model nor by noise{limit}. A diagnosis shows what "
        "is missing."
    )
