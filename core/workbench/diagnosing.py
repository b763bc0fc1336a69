"""Diagnosis of a model: faults of the building first, then the effect that the model lacks, and the worth of adding it.

An effect is named by `core.diagnosis`, which reasons on whitened residuals of the fitted earthquakes. Here every
version of the model is driven through all earthquakes, held-out ones among them, and an effect that does not lower the
error of these whole histories is not kept.
"""

from collections.abc import Collection, Sequence
from dataclasses import replace

from core.diagnosis.building_faults import building_faults
from core.diagnosis.missing_effects import Diagnosis, Outcome, diagnosed, outcome_of
from core.diagnosis.sensor_faults import IN_USE, BuildingFault, sensor_faults
from core.fitting.observation import Observation
from core.model.first_model import first_model
from core.model.isolator import Isolator
from core.record import Direction
from core.workbench.candidates import AS_GIVEN, REFITTED, Stage, stages
from core.workbench.comparing import compare
from core.workbench.correcting import corrected_copy
from core.workbench.diagnosis_result import DiagnosisResult, last_fit
from core.workbench.directions import check_directions, each_direction
from core.workbench.earthquakes import Earthquakes, Version, model_errors
from core.workbench.fitting import readable
from core.workbench.out_of_range import out_of_range
from core.workbench.progress import FINE, Progress, silent, within
from core.workbench.searching import search_effects


def diagnose(
    model: Isolator,
    earthquakes: Earthquakes | Sequence[Observation],
    *,
    hold_out: Collection[str] = (),
    effects: Collection[str] | None = None,
    directions: Collection[Direction] | None = None,
    progress: Progress = silent,
) -> DiagnosisResult:
    """Try every effect that the model does not have, and add those that the records support.

    Faults of sensors are corrected before in a copy of the records, where they are at hand, and forces for wrong
    masses. Effects are added to the model in its own directions; each direction is also diagnosed by itself.

    Args:
        model: of the isolation layer.
        earthquakes: observations of one building.
        hold_out: names of the earthquakes that only test the result.
        effects: names of the effects that may be added; None for all.
        directions: horizontal directions to look at by themselves; None for all that the records have.
        progress: called with each step.

    Raises:
        RecordError: no observation is left to fit to, or none has any of the directions.
        ModelError: a model's force grew beyond all bounds.
    """
    seen = corrected_copy(Earthquakes.of(earthquakes, hold_out), within(progress, 0.0, 0.1))
    check_directions(seen, directions)
    found = search_effects(model, seen, effects, within(progress, 0.1, 0.6))
    seen, diagnosis = found.earthquakes, found.diagnosis
    progress("locating the model's errors", 60, FINE)
    refitted = compare(readable(diagnosis.refitted.model), seen)
    progress("driving the versions by the motion and by the ground alone", 65, FINE)
    staged, versions = stages(diagnosis, Version(REFITTED, refitted.errors), seen)
    diagnosis = _with_steps(diagnosis, staged, seen)
    versions = (Version(AS_GIVEN, model_errors(model, seen)), *versions)
    failing = out_of_range(versions[-1].errors, seen)
    if failing and _fits(diagnosis):
        diagnosis = replace(diagnosis, outcome=Outcome.OUT_OF_RANGE)
    each = each_direction(diagnosis, model, seen, directions, found.offered, within(progress, 0.7, 1.0))
    progress("diagnosed", FINE, FINE)
    return DiagnosisResult(
        given=model,
        model=readable(last_fit(diagnosis, staged)[0].model),
        earthquakes=seen,
        diagnosis=diagnosis,
        refitted=refitted,
        candidates=found.candidates,
        faults=_faults(diagnosis, seen),
        stages=staged,
        versions=versions,
        out_of_range=failing,
        directions=each,
        diverging=found.diverging,
    )


def _fits(diagnosis: Diagnosis) -> bool:
    """True if nothing is missing where the model was fitted."""
    if diagnosis.outcome is Outcome.UNKNOWN:
        return not diagnosis.steps and not diagnosis.unexplained.is_there
    return diagnosis.outcome in {Outcome.NOTHING_MISSING, Outcome.REFIT}


def _with_steps(diagnosis: Diagnosis, kept: Sequence[Stage], earthquakes: Earthquakes) -> Diagnosis:
    """The diagnosis with the effects of these stages only, since the others do not lower the error of whole
    histories."""
    steps = tuple(one.step for one in kept)
    if len(steps) == len(diagnosis.steps):
        return replace(diagnosis, steps=steps)
    after = kept[-1].fit if kept else diagnosis.refitted
    again = diagnosed(earthquakes.fitted, after.model, (), held_out=earthquakes.tested)
    left = replace(again.unexplained, allowed=diagnosis.unexplained.allowed)
    held_out = again.ratios_before.held_out or 0.0
    return replace(
        diagnosis,
        outcome=outcome_of(steps, diagnosis.before, left, held_out, is_supported=True) if kept else Outcome.UNKNOWN,
        steps=steps,
        idle=(*(one for one in diagnosis.steps if not any(one is step for step in steps)), *diagnosis.idle),
        after=after,
        unexplained=left,
        ratios_after=again.ratios_before,
    )


def _faults(diagnosis: Diagnosis, earthquakes: Earthquakes) -> tuple[BuildingFault, ...]:
    """Faults of the building; the mass is judged only where the design's model explains everything."""
    description = earthquakes.description
    if description is None:
        return ()
    is_of_design = set(diagnosis.given.effects) == set(first_model(description).isolator.effects)
    explains = is_of_design and not diagnosis.steps and not diagnosis.unexplained.is_there
    if any(one.kind in IN_USE for one in earthquakes.corrected):
        # what a correction leaves may look like a soft storey
        left = sensor_faults(earthquakes.analyses, description)
    else:
        left = building_faults(earthquakes.analyses, description, diagnosis.refitted if explains else None)
    known = {(one.channel, one.kind) for one in earthquakes.corrected}
    return (*earthquakes.corrected, *(one for one in left if (one.channel, one.kind) not in known))
