"""A diagnosis of each horizontal direction by itself: an effect may act in one of them only, such as a wall."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from core.comparison.compared import compare_forces, force_misfit
from core.diagnosis.effect_search import Step
from core.diagnosis.floor_share import with_floor_share
from core.diagnosis.missing_effects import Diagnosis, Outcome, diagnosed
from core.effects import EFFECTS
from core.errors import ModelError, RecordError
from core.fitting.observation import Observation, observations
from core.model.isolator import Isolator
from core.record import Direction
from core.rounding import plain
from core.units import shown
from core.workbench.earthquakes import Earthquakes
from core.workbench.progress import Progress, in_shares, within
from core.workbench.texts import titled

HORIZONTAL: tuple[Direction, ...] = ("x", "y")
EXCLUDED = 1.5
"""Factor by which an effect of the other direction raises the error, from which on the records exclude it. A choice."""

NEXT_TO_NOTHING = 0.02
"""Share of the excess error in one direction below which no other effect than those of both is looked for there. A
choice, for the time that it saves."""


@dataclass(frozen=True, slots=True, eq=False)
class DirectionDiagnosis:
    """Diagnosis of the model in one direction."""

    direction: Direction
    diagnosis: Diagnosis
    earthquakes: Earthquakes
    """Observations in this direction."""

    @property
    def largest(self) -> float:
        """m, largest displacement that it was fitted to."""
        return max(float(np.abs(one.layer.displacement).max()) for one in self.earthquakes.fitted)


def check_directions(seen: Earthquakes, wanted: Collection[Direction] | None) -> None:
    """Raise RecordError if no fitted earthquake has any of the wanted directions.

    Args:
        seen: the earthquakes of a diagnosis.
        wanted: directions to look at by themselves; None for all.
    """
    if wanted is None or any(_along(seen, direction).fitted for direction in wanted):
        return
    there = " and ".join(direction for direction in HORIZONTAL if _along(seen, direction).fitted)
    raise RecordError(
        f"no earthquake has force and motion of the layer in direction {' or '.join(wanted)}: choose {there}, or add "
        "records"
    )


def each_direction(
    whole: Diagnosis,
    model: Isolator,
    seen: Earthquakes,
    directions: Collection[Direction] | None,
    offered: Collection[str],
    progress: Progress,
) -> tuple[DirectionDiagnosis, ...]:
    """The diagnosis of each direction alone; none where the only one that is there, or wanted, is the model's own.

    Args:
        whole: the diagnosis of the model by all its directions together.
        model: that was diagnosed; its values are where the search begins in every direction.
        seen: the earthquakes that it was diagnosed by.
        directions: those to look at; None for all.
        offered: names of the effects that may be added.
        progress: called with each step.
    """
    known = {
        direction: found
        for direction in HORIZONTAL
        if (directions is None or direction in directions) and (found := _along(seen, direction)).fitted
    }
    if len(known) < len(HORIZONTAL) and set(known) <= set(seen.directions):
        return ()
    each = []
    for number, (direction, earthquakes) in enumerate(known.items()):
        doing = f"diagnosing direction {direction}"
        own = in_shares(within(progress, number / len(known), (number + 1) / len(known)))
        try:
            alone = whole if seen.directions == (direction,) else _alone(whole, model, earthquakes, offered, own, doing)
        except ModelError:  # a value of one direction that is impossible in the other
            return ()
        each.append(DirectionDiagnosis(direction, alone, earthquakes))
    return tuple(each)


def _alone(
    whole: Diagnosis,
    model: Isolator,
    earthquakes: Earthquakes,
    offered: Collection[str],
    report: Callable[[str, float], None],
    doing: str,
) -> Diagnosis:
    """The diagnosis of one direction: with the effects of the whole one where these explain the records, else with all
    that are offered."""
    known = {one.effect for step in whole.steps for one in step.alike}
    found = diagnosed(earthquakes.fitted, model, known, report, earthquakes.tested, doing)
    left = found.unexplained
    is_explained = found.outcome is not Outcome.UNKNOWN and (
        not left.is_there or left.excess < NEXT_TO_NOTHING * found.before.excess
    )
    return found if is_explained else diagnosed(earthquakes.fitted, model, offered, report, earthquakes.tested, doing)


def _along(seen: Earthquakes, direction: Direction) -> Earthquakes:
    """The earthquakes in one direction, which need not be the model's."""
    there = [one for one in seen.observations if one.direction == direction]
    return Earthquakes(tuple(there or _across(seen, direction)), band=seen.band, held_out=seen.held_out)


def _across(seen: Earthquakes, direction: Direction) -> Iterator[Observation]:
    for one in seen.sources:
        if one.analysis is None or one.recording is None:
            continue
        every = observations(one.analysis, one.recording.description, one.name, one.recording.reference)
        yield from (with_floor_share(found, seen.share_change) for found in every if found.direction == direction)


def only_in_one(each: Sequence[DirectionDiagnosis]) -> Iterator[tuple[DirectionDiagnosis, Step, DirectionDiagnosis]]:
    """Effects that are missing in one direction only: that direction, the step, and the other direction."""
    for here, other in permutations(each, 2):
        there = {one.effect for step in other.diagnosis.named for one in step.alike}
        families = {EFFECTS[name].family for name in there}
        for step in here.diagnosis.named:
            if EFFECTS[step.chosen.effect].family not in families:
                yield here, step, other


def direction_sentences(each: Sequence[DirectionDiagnosis]) -> Iterator[str]:
    """Sentences on effects that act in one direction only; none where both directions lack the same. Where another
    direction than the model's was wanted alone, what it lacks."""
    if len(each) == 1:
        yield from _alone_sentences(each[0])
    for here, step, other in only_in_one(each):
        name, there = step.chosen.effect, other.direction
        yield f"In direction {here.direction} only: {titled(name)}."
        yield _in_the_other(here, name, other, there)


def _alone_sentences(one: DirectionDiagnosis) -> Iterator[str]:
    named = [titled(step.chosen.effect) for step in one.diagnosis.named]
    if named:
        yield from (f"In direction {one.direction}: {effect}." for effect in named)
    elif one.diagnosis.outcome is Outcome.UNKNOWN:
        yield f"In direction {one.direction} something is missing that no known effect explains."
    else:
        yield f"In direction {one.direction} no known effect is missing."


def _in_the_other(here: DirectionDiagnosis, effect: str, other: DirectionDiagnosis, there: str) -> str:
    without = other.diagnosis.refitted.model
    values = here.diagnosis.after.model.effects[effect]
    before, after = (
        _noise_ratio(one, other.earthquakes) for one in (without, Isolator({**without.effects, effect: values}))
    )
    if after > EXCLUDED * before:
        return (
            f"With the same values in direction {there}, the error would rise from {plain(before, 3)} to "
            f"{plain(after, 3)} times the noise."
        )
    if other.diagnosis.outcome is Outcome.UNKNOWN:
        return f"In direction {there} something is missing that no known effect explains."
    reach = plain(shown(other.largest, "m"), 3)
    return f"The records of direction {there}, up to {reach} mm, neither show nor exclude it."


def _noise_ratio(model: Isolator, earthquakes: Earthquakes) -> float:
    """Noise ratio where the direction was fitted; infinite where the force grows beyond all bounds."""
    try:
        return force_misfit(compare_forces(model, earthquakes.fitted, earthquakes.band)).noise_ratio
    except ModelError:
        return float("inf")
