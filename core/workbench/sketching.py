"""Sketch of the force that a model lacks, where no known effect explains it.

The missing force with its deviation, what it depends on, and the simplest law that lowers the error where nothing was
fitted: of the force for the measured motion, and of the response to the ground motion alone.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Vector
from core.comparison.compared import ForceComparison, compare_forces
from core.comparison.prediction import predicted_displacement
from core.diagnosis.worth import EARNS_HELD_OUT, TESTED, excess
from core.effect import Effect
from core.effects import EFFECTS, add_effect, also, only
from core.errors import ModelError
from core.fitting.fit import Fit, WeightedFit, check_motion, weighted_fit
from core.fitting.noise import force_noise, noise_rms
from core.fitting.observation import Observation
from core.model.isolator import Isolator
from core.rounding import plain
from core.sketching.course import Course, axis_of, course
from core.sketching.dependence import Dependence, dependences
from core.sketching.law import Law, effect_of, effect_source, formula, starts
from core.sketching.search import Found, Sketched, search
from core.sketching.terms import Scales
from core.sketching.texts import known_range
from core.tables import Table, report
from core.units import percent_in_table
from core.workbench.comparing import counted
from core.workbench.earthquakes import FITTED, HELD_OUT, Earthquakes, Version, helps, model_errors
from core.workbench.fitting import deviations, readable
from core.workbench.progress import Progress, silent
from core.workbench.tables import Deviations, gain, values_table, version_tables

NAME = "sketched_force"
"""Name of the effect unless another is given."""
VISIBLE = 0.01
"""Share of the residual's power from which on a variable is worth a word. A choice."""
MOST_TRIED = 4
"""Laws that are fitted together with the model, until one lowers the error where nothing was fitted. A choice."""
STEPS = 3
"""Steps of a sketch."""


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """A law, joined to the model and fitted with it."""

    name: str
    """Name of the effect."""
    law: Sketched
    written: Law
    """The same as values, from which the source is written."""
    formula: str
    source: str
    """Text of the effect's file."""
    model: Isolator
    """The model with the effect, its values rounded to six digits."""
    fit: Fit
    inflation: float
    """Ratio of the variances to those that the measurement's noise alone would cause."""
    forces: tuple[Vector, ...]
    """(n,) N, the law's in each earthquake and direction, in the order of the comparisons."""

    @property
    def effect(self) -> Effect:
        """The effect of the file; made from its text, because a function of no module cannot be pickled."""
        return effect_of(self.name, self.source)

    @property
    def std(self) -> Deviations:
        """Standard deviations by effect and parameter, SI units."""
        return deviations(self.fit, self.inflation)


@dataclass(frozen=True, slots=True, eq=False)
class SketchResult:
    """Estimate of the force that a model lacks, with its sketches."""

    given: Isolator
    earthquakes: Earthquakes
    """With the earthquake that the sketch held out itself, if it did."""
    versions: tuple[Version, ...]
    """The model as given, refitted, and with the proposal if one was tried."""
    dependences: tuple[Dependence, ...]
    found: Found
    scales: Scales
    proposal: Proposal | None
    """None if nothing is proposed."""
    ended: str
    """Reason why nothing is proposed; empty if something is."""
    chosen_here: str = ""
    """Name of the earthquake that the sketch held out itself; empty if it did not."""

    @property
    def missing(self) -> tuple[ForceComparison, ...]:
        """The missing force with its deviation: the residuals of the refitted model."""
        return self.versions[1].errors.forces

    @property
    def course(self) -> Course:
        """The missing force over the variable that it depends on; with a proposal, beside its law."""
        if self.proposal is None:
            depends = [one.variable for one in self.dependences if one.share > VISIBLE]
            return course(axis_of(depends), self.scales, self.missing)
        depends = [variable for one in self.proposal.law.placed for variable in one.term.depends]
        return course(axis_of(depends), self.scales, self.versions[2].errors.forces, self.proposal.forces)

    @property
    def taken(self) -> dict[str, float]:
        """Share of the excess error of the force that the proposal takes, by group of earthquakes."""
        if self.proposal is None:
            return {}
        before, after = self.versions[1], self.versions[2]
        return {
            group: 1 - excess(after.error(names).noise_ratio) / excess(before.error(names).noise_ratio)
            for group, names in self.earthquakes.groups.items()
            if excess(before.error(names).noise_ratio) > 0
        }

    @property
    def text(self) -> tuple[str, ...]:
        """Sentences: what is missing, on what it depends, what is proposed, and what the records cannot show."""
        return tuple(_sentences(self))

    def __str__(self) -> str:
        values: list[Table] = []
        if one := self.proposal:
            with also({one.name: one.effect}):  # another process may not know it
                values = [values_table(one.model, one.std)]
        tables = (missing_table(self), dependence_table(self), *values)
        title = f"Sketch of what {', '.join(self.given.effects)} lacks, from {counted(self.earthquakes)}"
        return report(title, self.text, *tables, *version_tables(self.versions, self.earthquakes))


def sketch(
    model: Isolator,
    earthquakes: Earthquakes | Sequence[Observation],
    *,
    hold_out: Collection[str] = (),
    name: str = NAME,
    progress: Progress = silent,
) -> SketchResult:
    """Sketch the force that a model lacks; where a law is proposed, it becomes an effect of this process.

    Args:
        model: of the isolation layer.
        earthquakes: observations of one building.
        hold_out: names of the earthquakes that only test the result; where none is held out and there are several, the
            sketch holds out the second strongest.
        name: of the effect that is proposed, not that of another one.
        progress: called with each step.

    Raises:
        RecordError: no observation is left to fit to.
        ModelError: the name is taken or is none, or a model's force grew beyond all bounds.
    """
    seen, chosen_here = _with_one_held_out(Earthquakes.of(earthquakes, hold_out))
    check_motion(seen.fitted)
    if name in EFFECTS or not name.isidentifier():
        raise ModelError(
            f"an effect cannot be called {name!r}: choose an unused name of letters, digits and _, no digit first"
        )
    progress("fitting the model", 0, STEPS)
    base = weighted_fit(seen.fitted, model)
    versions = [Version("as given", model_errors(model, seen))]
    versions.append(Version("refitted", model_errors(base.fit.model, seen)))
    progress("searching for terms", 1, STEPS)
    noise = np.array([noise_rms(force_noise(one).whitening) for one in base.data.observations])
    terms, found = search(base.data, base.fit, noise, base.inflation)
    depends = dependences(base.data, base.fit, terms)
    tried: list[tuple[Proposal, Version, str]] = []
    for law in found.supported[:MOST_TRIED]:
        progress("fitting the law together with the model", 2, STEPS)
        proposal, version = _tried(name, law, terms.scales, base, seen)
        tried.append((proposal, version, _objection(versions[1], version, seen)))
        if not tried[-1][2]:
            break
    base.data.memory.clear()
    progress("sketch finished", STEPS, STEPS)
    kept, ended = None, NOTHING
    if tried:
        proposal, version, ended = tried[0] if tried[-1][2] else tried[-1]
        kept = None if ended else proposal
        versions.append(version)
    if kept is not None:
        add_effect(name, kept.effect)
    return SketchResult(model, seen, tuple(versions), depends, found, terms.scales, kept, ended, chosen_here)


NOTHING = "No law is supported: nothing in the missing force depends on the motion or the conditions beyond doubt."
NO_GAIN = "The best law lowers the error only where it was fitted, so that it is not proposed."
NO_GAIN_FREE = (
    "The best law lowers the error of the force, but not that of the response to the ground motion alone on held-out "
    "earthquakes, so that it is not proposed."
)


def _with_one_held_out(seen: Earthquakes) -> tuple[Earthquakes, str]:
    """The earthquakes with the second strongest held out, and its name, if none is and there are several."""
    names = seen.fitted_names
    if seen.tested or len(names) < 2:
        return seen, ""
    peaks = {
        name: max(float(np.abs(one.layer.displacement).max()) for one in seen.fitted if one.name == name)
        for name in names
    }
    second = sorted(names, key=lambda name: -peaks[name])[1]
    return replace(seen, held_out=frozenset({second})), second


def _tried(name: str, law: Sketched, scales: Scales, base: WeightedFit, seen: Earthquakes) -> tuple[Proposal, Version]:
    """The law as an effect, fitted together with the model, and the errors of the model with it."""
    written = Law(law.placed, tuple(map(float, law.amplitudes)), scales)
    source = effect_source(name, written)
    effect = effect_of(name, source)
    with only(base.fit.model.effects):
        add_effect(name, effect)
        joined = Isolator({**base.fit.model.effects, name: starts(written)})
        fit = weighted_fit(seen.fitted, joined)
        model = readable(fit.fit.model)
        errors = model_errors(model, seen)
        without = Isolator({**model.effects, name: {**model.effects[name], **effect.absent}})
        rest = compare_forces(without, seen.observations, seen.band)
        forces = tuple(one.model - other.model for one, other in zip(errors.forces, rest, strict=True))
    proposal = Proposal(name, law, written, formula(written), source, model, fit.fit, fit.inflation, forces)
    return proposal, Version(f"with {name}", errors)


def _objection(before: Version, after: Version, seen: Earthquakes) -> str:
    """Reason not to propose a law; empty if there is none. On held-out earthquakes it has to take as much of the excess
    error as an effect that is named."""
    ratios = [one.error(seen.groups[HELD_OUT]).noise_ratio for one in (before, after) if HELD_OUT in seen.groups]
    if ratios and ratios[0] > TESTED and 1 - excess(ratios[1]) / excess(ratios[0]) < EARNS_HELD_OUT:
        return NO_GAIN
    if not helps(before, after, seen) or after.error(seen.fitted_names).rms >= before.error(seen.fitted_names).rms:
        return NO_GAIN
    names = seen.groups.get(HELD_OUT, seen.fitted_names)
    free = [one.errors.of(names).predictions for one in (before, after)]
    if all(free) and predicted_displacement(free[1]).rms >= predicted_displacement(free[0]).rms:
        return NO_GAIN_FREE
    return ""


def missing_table(result: SketchResult) -> Table:
    """The missing force of each earthquake, with the deviation that noise makes."""
    rows = tuple(
        (
            result.earthquakes.label(one.observation.name, one.observation.direction),
            f"{plain(1e-3 * one.misfit.excess, 3)} kN",
            f"{plain(1e-3 * one.noise.rms, 3)} kN",
            f"{one.misfit.noise_ratio:.3g}",
        )
        for one in result.missing
    )
    return Table(
        "Missing force",
        ("earthquake", "beyond the noise", "noise", "noise ratio"),
        rows,
        "Root mean square of what the refitted model leaves over, and of the noise in it.",
    )


def dependence_table(result: SketchResult) -> Table:
    """Variables on which the missing force depends."""
    rows = tuple((one.variable, percent_in_table(max(0.0, one.share))) for one in result.dependences)
    return Table(
        "What it depends on",
        ("variable", "predicted"),
        rows,
        "Share of its power that functions of each variable predict in blocks to which they were not fitted. The "
        "shares overlap: one variable may stand for another.",
    )


def _sentences(result: SketchResult) -> Iterator[str]:
    refitted = result.versions[1].error(result.earthquakes.fitted_names)
    yield (
        f"The refitted model leaves {plain(1e-3 * refitted.rms, 3)} kN of force, "
        f"{refitted.noise_ratio:.3g} times what noise alone makes."
    )
    if depends := [one.variable for one in result.dependences if one.share > VISIBLE]:
        yield f"It depends on: {', '.join(depends)}."
    proposal = result.proposal
    if proposal is None:
        yield result.ended
        return
    yield f"Proposed: {', '.join(one.term.name for one in proposal.law.placed)}; its law is `{proposal.formula}`."
    yield from gain(result.versions[1], result.versions[2], result.earthquakes)
    for group, share in result.taken.items():
        where = {FITTED: "where it was fitted", HELD_OUT: "on held-out earthquakes"}[group]
        yield f"It takes {100 * share:.0f} % of the error beyond the noise {where}."
    if result.chosen_here:
        yield f"The sketch held out {result.chosen_here} itself, the second strongest earthquake."
    yield known_range(result.scales)
    if proposal.law.alike:
        yield f"The records cannot distinguish it from: {', '.join(proposal.law.alike)}."
    if proposal.fit.undetermined:
        yield f"Not determined: {', '.join(f'{key} of {effect}' for effect, key in proposal.fit.undetermined)}."
    yield "A sketch describes these records; it does not name a cause."
