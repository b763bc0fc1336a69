"""A diagnosis of one building with a hidden effect."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path
from time import process_time

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the generator is the tests'

from hidden.case import ONE_DIRECTION
from hidden.trial import Event, Trial, trial

from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.diagnosis.building_faults import building_faults
from core.diagnosis.missing_effects import Diagnosis
from core.diagnosis.sensor_faults import BuildingFault
from core.effects import EFFECTS
from core.estimators.superstructure import known_superstructure
from core.fitting.observation import Observation, observations
from core.model.first_model import first_model
from core.model.force_response import force_response
from core.model.isolator import Isolator, carried
from core.model.simulation import Axis, respond
from core.record import Direction, Segment
from core.workbench import diagnose
from core.workbench.correcting import corrected_copy
from core.workbench.directions import HORIZONTAL, only_in_one
from core.workbench.earthquakes import Earthquakes, Recording, analysed as of_analysis, joined

REFUSED = "refused"
"""Outcome where no earthquake can be used and nothing is suspected."""


WEAK = "+weak"
"""End of a case whose strongest earthquake is held out too: what is fitted is weaker, by more than a factor of two."""


@dataclass(frozen=True, slots=True)
class Row:
    """One trial, as it is kept."""

    case: str
    seed: int
    noise: float
    """Noise of each channel, over its root mean square."""
    misfit: float
    """Change of the force by the hidden effect, over the force."""
    hidden: tuple[str, ...]
    """Effects; an empty name for a law that the library has not."""
    outcome: str
    unknown: bool
    named: tuple[str, ...]
    """Effects that were named, in their order."""
    sets: tuple[tuple[str, ...], ...]
    """Effects that the records could not distinguish from each of them, itself included."""
    suspects: tuple[str, ...]
    """Kinds of what was suspected before the layer, each with its channel."""
    before: float
    """Residual over noise floor."""
    after: float
    predicted: float
    """NRMSE of the displacement in an earthquake that was not used, by the ground alone, against the exact one."""
    predicted_before: float
    """The same of the model that was given, its values fitted."""
    seconds: float
    """Processor time of the diagnosis, s."""
    resembles: tuple[str, ...] = ()
    """Effects that are nearest to something unknown."""
    one_way: tuple[str, ...] = ()
    """Effects that were said to act in one direction only, each with its direction; only where y was looked at too."""


def row(case: str, seed: int) -> Row:
    """The trial of that case and seed, diagnosed."""
    return row_of(replace(trial(case.removesuffix(WEAK), seed), case=case))


def row_of(made: Trial) -> Row:
    """A trial, diagnosed."""
    analyses = [analysed(event, made) for event in made.events]
    seen = corrected_copy(_earthquakes(made, analyses))
    if not seen.fitted:
        return _of_sensors_alone(made, seen)
    begun = process_time()
    looked_at: tuple[Direction, ...] = HORIZONTAL if made.case in ONE_DIRECTION else ("x",)
    result = diagnose(first_model(made.description).isolator, seen, directions=looked_at)
    seconds = process_time() - begun
    found = result.diagnosis
    new = _along_x(analyses[-1], made)  # as recorded: a correction may shift its samples against the exact ones
    return Row(
        made.case,
        made.seed,
        made.noise.level,
        made.misfit,
        made.effects,
        result.outcome,
        found.is_unknown,
        tuple(step.chosen.effect for step in found.named),
        tuple(tuple(one.effect for one in step.alike) for step in found.named),
        _named(result.faults),
        found.before.noise_ratio,
        found.unexplained.noise_ratio,
        *(_predicted(model, [*seen.fitted, *new], seen.analyses, made) for model in _models(found)),
        seconds,
        found.resembles,
        tuple(f"{step.chosen.effect}@{here.direction}" for here, step, _ in only_in_one(result.directions)),
    )


def _of_sensors_alone(made: Trial, seen: Earthquakes) -> Row:
    """Every earthquake was refused: what is suspected is the diagnosis, as in `menshin model diagnose`."""
    suspects = (*seen.corrected, *building_faults(seen.analyses, made.description))
    return Row(
        case=made.case,
        seed=made.seed,
        noise=made.noise.level,
        misfit=made.misfit,
        hidden=made.effects,
        outcome=suspects[0].cause.value if suspects else REFUSED,
        unknown=False,
        named=(),
        sets=(),
        suspects=_named(suspects),
        before=nan,
        after=nan,
        predicted=nan,
        predicted_before=nan,
        seconds=0.0,
    )


def _earthquakes(made: Trial, analyses: Sequence[EventAnalysis]) -> Earthquakes:
    """The earthquakes along x, with the samples that they were analysed from; those not for fitting are held out."""
    settings, reference = AnalysisSettings(), made.events[0].start
    each = [
        of_analysis(
            f"earthquake {number}",
            analysis,
            Recording(_segments(event), made.description, settings, ("x",), reference),
        )
        for number, (event, analysis) in enumerate(zip(made.events, analyses, strict=True))
    ]
    later = [one.name for one in each[len(made.fitted) :]]
    if made.case.endswith(WEAK):
        peaks = [float(np.abs(event.displacement[0]).max()) for event in made.fitted]
        later.append(each[int(np.argmax(peaks))].name)
    return joined(each, made.description, settings.band, reference=reference, held_out=later)


def _segments(event: Event) -> tuple[Segment, ...]:
    return tuple(
        Segment(channel.id, event.start, event.record.rate, samples)
        for channel, samples in zip(event.record.channels, event.record.samples, strict=True)
    )


def _named(suspects: Sequence[BuildingFault]) -> tuple[str, ...]:
    return tuple(f"{one.kind}@{one.channel}" for one in suspects)


def analysed(event: Event, made: Trial) -> EventAnalysis:
    """The product's analysis of an earthquake's records."""
    return analyse(_segments(event), made.description, AnalysisSettings())


def family(effects: Sequence[str]) -> set[str]:
    """Family of each effect."""
    return {EFFECTS[name].family for name in effects if name}


def _along_x(found: EventAnalysis, made: Trial) -> list[Observation]:
    every = observations(found, made.description, "predicted", made.events[0].start)
    return [one for one in every if one.direction == "x"]


def _models(found: Diagnosis) -> tuple[Isolator, Isolator]:
    return found.after.model, found.refitted.model


def _predicted(model: Isolator, seen: Sequence[Observation], analyses: Sequence[EventAnalysis], made: Trial) -> float:
    """Error in the earthquake after those that were fitted; NaN if it was not analysed."""
    event = made.events[len(made.fitted)]
    new = next((one for one in seen if one.start >= event.start), None)
    if new is None:
        return nan
    states = None
    for one in seen[: seen.index(new)]:
        answer = force_response(
            model, one.layer.displacement, one.layer.velocity, one.rate, conditions=one.conditions, states=states
        )
        states = carried(model, answer.states)
    forces = [one.directions["x"].restoring_force for one in analyses[: len(made.fitted)] if "x" in one.directions]
    known = known_superstructure(forces, made.description)
    axis = Axis(known.modes, event.ground[0], new.conditions, states)
    (response,) = respond([axis], made.description.base_mass, model, new.rate)
    exact = event.displacement[0]
    return float(np.linalg.norm(response.isolator_displacement - exact) / np.linalg.norm(exact))
