"""Improvement of a model: one effect added by its name, or effects added by turns of diagnosis and fit.

In turns an effect is added only if it lowers the error on held-out earthquakes too, where there are any. If something
unknown is missing, only such earthquakes can justify an effect: the nearest known one is then nearly always
significant, and wrong. The stronger of the fitted earthquakes are then predicted by the weaker ones
(core.workbench.cross_validation), and those held out only test the result.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

from core.comparison.misfit import Misfit
from core.diagnosis.missing_effects import Outcome
from core.diagnosis.ranking import DECISIVE, ranked
from core.diagnosis.worth import EARNS
from core.effects import EFFECTS
from core.errors import ModelError
from core.fitting.data import FitData
from core.fitting.fit import Fit, check_motion, weighted_fit
from core.fitting.observation import Observation
from core.model.isolator import Isolator, parameter
from core.rounding import plain
from core.tables import Table, report
from core.units import percent, quantity
from core.workbench.candidates import AS_GIVEN, REFITTED, Candidate, candidates
from core.workbench.comparing import counted
from core.workbench.cross_validation import Beyond, Validated, beyond_range, can_validate, is_exhausted, validated
from core.workbench.diagnosing import diagnose
from core.workbench.diagnosis_result import DiagnosisResult, last_fit
from core.workbench.earthquakes import Earthquakes, Version, helps, model_errors, peak
from core.workbench.fitting import deviations, fit_sentences, readable
from core.workbench.out_of_range import BEYOND
from core.workbench.progress import Progress, silent, within
from core.workbench.tables import Deviations, gain, values_table, version_tables
from core.workbench.texts import action

DIAGNOSED = 0.8
"""Share of the work after all diagnoses; each takes half of the way to it. A choice."""
ROUNDS = 3
"""Diagnoses at most. A choice."""
MOST_DIAGNOSES = (
    "Improvement ended: the maximum number of diagnoses was reached; run `menshin model improve` again to continue."
)
BEFORE, IMPROVED = "before", "improved"
"""Names of the model before and after all changes."""
STRONGER = "stronger by weaker"
"""Name of the errors in stronger earthquakes than those fitted."""


@dataclass(frozen=True, slots=True, eq=False)
class ExtensionResult:
    """A model with one more effect, everything fitted anew."""

    given: Isolator
    model: Isolator
    """The model with the effect, its values rounded to six digits."""
    effect: str
    candidate: Candidate
    fit: Fit
    inflation: float
    """Ratio of the variances to those that the measurement's noise alone would cause."""
    earthquakes: Earthquakes
    versions: tuple[Version, ...]
    """The model as given, refitted without the effect, and with it."""

    @property
    def before(self) -> Misfit:
        """N, of the refitted model's force without the effect, where it was fitted."""
        return self.versions[1].error(self.earthquakes.fitted_names)

    @property
    def std(self) -> Deviations:
        """Standard deviations by effect and parameter, SI units."""
        return deviations(self.fit, self.inflation)

    @property
    def text(self) -> tuple[str, ...]:
        """Sentences: the effect, its support by the records, the change of the error, and how the fit ended."""
        return tuple(_extension_sentences(self))

    @property
    def fit_text(self) -> tuple[str, ...]:
        """Sentences on how the fit ended, and on what weakens it."""
        return fit_sentences(self.fit, self.inflation)

    def __str__(self) -> str:
        tables = (values_table(self.model, self.std), *version_tables(self.versions, self.earthquakes))
        title = f"{EFFECTS[self.effect].title} added to {', '.join(self.given.effects)}"
        return report(f"{title}, fitted to {counted(self.earthquakes)}", self.text, *tables)


def add(
    effect: str,
    model: Isolator,
    earthquakes: Earthquakes | Sequence[Observation],
    *,
    hold_out: Collection[str] = (),
    progress: Progress = silent,
) -> ExtensionResult:
    """Add an effect to a model, with or without support by the records, and fit everything anew.

    Args:
        effect: its name; the model does not have it.
        model: of the isolation layer.
        earthquakes: observations of one building.
        hold_out: names of the earthquakes that only test the result.
        progress: called with each step.

    Raises:
        RecordError: no observation is left to fit to.
        ModelError: there is no such effect, the model has it, or a model's force grew beyond all bounds.
    """
    seen = Earthquakes.of(earthquakes, hold_out)
    check_motion(seen.fitted)
    if effect not in EFFECTS:
        raise ModelError(f"there is no effect {effect!r}; there are {', '.join(sorted(EFFECTS))}")
    if effect in model.effects:
        raise ModelError(f"the model has {effect} already; fit the model instead")
    progress(f"fitting the model with {effect}", 0, 2)
    by_noise = FitData.by_noise(sorted(seen.fitted, key=lambda one: one.start))
    ranking = ranked(by_noise, model, (effect,))
    tried, diverging = candidates(ranking, seen)
    for one in (*ranking.dropped, *diverging):
        raise ModelError(f"{one.effect} cannot be added: {one.reason}")
    (candidate,) = tried
    progress("driving the versions by the motion and by the ground alone", 1, 2)
    versions = (
        Version(AS_GIVEN, model_errors(model, seen)),
        Version(REFITTED, model_errors(ranking.base.model, seen)),
        Version(f"with {effect}", model_errors(candidate.fit.model, seen)),
    )
    by_noise.memory.clear()
    progress("added", 2, 2)
    better = readable(candidate.fit.model)
    return ExtensionResult(model, better, effect, candidate, candidate.fit, ranking.inflation, seen, versions)


def _extension_sentences(result: ExtensionResult) -> Iterator[str]:
    about, tried = EFFECTS[result.effect], result.candidate
    bic = f"ΔBIC {plain(tried.delta_bic, 3)}"
    yield f"{about.title} ({result.effect}): {action(result.model, result.effect, result.earthquakes)}"
    if tried.delta_bic < -DECISIVE:
        yield f"The records support it ({bic}, below −{DECISIVE:g})."
    else:
        yield f"The records do not support it ({bic}, not below −{DECISIVE:g}); it was added as requested."
    if tried.implausible:
        yield f"It is implausible: {tried.implausible}."
    yield from gain(result.versions[1], result.versions[2], result.earthquakes)
    yield from result.fit_text


@dataclass(frozen=True, slots=True, eq=False)
class ImprovementResult:
    """A model with all effects that diagnoses support and held-out earthquakes confirm."""

    given: Isolator
    rounds: tuple[DiagnosisResult, ...]
    model: Isolator
    """The improved model, its values rounded to six digits."""
    fit: Fit
    inflation: float
    """Ratio of the variances to those that the measurement's noise alone would cause."""
    added: tuple[str, ...]
    """Effects in the order in which they were added."""
    ended: str
    """The reason for its end, as a sentence."""
    versions: tuple[Version, ...]
    """The model as given, refitted, then with each effect that a diagnosis added, and after all changes by earthquakes
    left out."""
    earthquakes: Earthquakes
    left_out: tuple[Validated, ...] = ()
    """The model before and after each change by which stronger earthquakes are predicted better by weaker ones; none
    where diagnoses were enough."""
    beyond: tuple[Beyond, ...] = ()
    """Expected errors of predictions beyond the range of the fitted earthquakes; empty where diagnoses were enough."""

    @property
    def std(self) -> Deviations:
        """Standard deviations by effect and parameter, SI units."""
        return deviations(self.fit, self.inflation)

    @property
    def text(self) -> tuple[str, ...]:
        """Sentences: the motion, the effects that were added, the reason for the end, the change of the error, and the
        last fit."""
        return tuple(_improvement_sentences(self))

    @property
    def ending_text(self) -> tuple[str, ...]:
        """The same from the reason for the end on."""
        return tuple(_ending_sentences(self))

    def __str__(self) -> str:
        tables = (
            values_table(self.model, self.std),
            *version_tables(self.versions, self.earthquakes),
            *left_out_tables(self),
        )
        title = f"Improvement of {', '.join(self.given.effects)} by {counted(self.earthquakes)}"
        return report(title, self.text, *tables)


def improve(
    model: Isolator,
    earthquakes: Earthquakes | Sequence[Observation],
    *,
    hold_out: Collection[str] = (),
    effects: Collection[str] | None = None,
    progress: Progress = silent,
) -> ImprovementResult:
    """Diagnose a model and add the supported effects, by turns.

    If something unknown is left and two or more earthquakes are fitted, the stronger of these are predicted by the
    model fitted to the weaker ones, and effects are added as long as this becomes better; those added before that have
    lost their worth are removed. No name is claimed for what they describe. This begins with the effects that diagnoses
    named: one that only resembles what is missing would be in the way of the right ones.

    Args:
        model: of the isolation layer.
        earthquakes: observations of one building.
        hold_out: names of the earthquakes that only test the result.
        effects: names of the effects that may be added; None for all.
        progress: called with each step.

    Raises:
        RecordError: no observation is left to fit to.
        ModelError: a model's force grew beyond all bounds.
    """
    seen = Earthquakes.of(earthquakes, hold_out)
    rounds: list[DiagnosisResult] = []
    added: list[str] = []
    versions: list[Version] = []
    now, ended = model, MOST_DIAGNOSES
    named, named_effects = model, list[str]()
    while len(rounds) < ROUNDS:
        begin, end = (DIAGNOSED * (1 - 0.5**number) for number in (len(rounds), len(rounds) + 1))
        result = diagnose(now, seen, effects=effects, progress=within(progress, begin, end))
        rounds.append(result)
        count = _confirmed(result)
        versions += result.versions[0 if not versions else 2 : 2 + count]
        added += [stage.effect for stage in result.stages[:count]]
        fit, inflation = last_fit(result.diagnosis, result.stages[:count])
        now = readable(fit.model)
        if result.diagnosis.outcome is not Outcome.UNKNOWN:
            named, named_effects = now, list(added)
        if reason := _reason_to_end(result, count):
            ended = reason
            break
    steps: tuple[Validated, ...] = ()
    beyond: tuple[Beyond, ...] = ()
    if rounds[-1].diagnosis.outcome is Outcome.UNKNOWN and not rounds[-1].faults and can_validate(seen):
        offered = set(EFFECTS if effects is None else effects)
        steps = tuple(validated(named, seen, model.effects, offered, within(progress, DIAGNOSED, 1.0)))
    if len(steps) > 1:
        ended = (
            "Improvement ended: as many effects were added as one improvement adds by predicting stronger earthquakes."
            if is_exhausted(steps)
            else "Improvement ended: no further effect lowers the error in stronger earthquakes than those fitted."
        )
        last = weighted_fit(seen.fitted, steps[-1].model, steps[-1].zero)
        fit, inflation, now = last.fit, last.inflation, readable(last.fit.model)
        versions.append(Version(IMPROVED, model_errors(now, seen)))
        tried = [*named_effects, *(step.change for step in steps[1:] if step.is_added)]
        added = [name for name in tried if name in now.effects]
        beyond = beyond_range(steps[-1], seen)
    made = tuple(added)
    return ImprovementResult(
        model, tuple(rounds), now, fit, inflation, made, ended, tuple(versions), seen, steps, beyond
    )


def _confirmed(result: DiagnosisResult) -> int:
    """Number of effects, from the first on, that are worth adding.

    If something unknown is missing, the next best name is a stand-in, which is justified by half of the excess error
    that it explains, or by held-out earthquakes.
    """
    is_unknown = result.diagnosis.outcome is Outcome.UNKNOWN and result.diagnosis.explained.fitted < EARNS
    if result.faults or (is_unknown and not result.earthquakes.held_out):
        return 0
    count = 0
    for before, after in zip(result.versions[1:], result.versions[2:], strict=False):
        if not helps(before, after, result.earthquakes):
            break
        count += 1
    return count


def _reason_to_end(result: DiagnosisResult, count: int) -> str | None:
    """Reason to add nothing more; None if another diagnosis may support more."""
    if result.faults:
        kinds = ", ".join(dict.fromkeys(one.kind for one in result.faults))
        return (
            f"Improvement ended: the building or its sensors have a fault ({kinds}); `menshin model diagnose` "
            "describes it."
        )
    if result.diagnosis.outcome is Outcome.UNKNOWN and not count:
        return "Improvement ended: the remaining error has structure that no known effect explains."
    if count < len(result.stages):
        return (
            f"Improvement ended: {result.stages[count].effect} has support but does not lower the error on held-out "
            "earthquakes."
        )
    if result.diagnosis.outcome is Outcome.OUT_OF_RANGE:
        return (
            "Improvement ended: no effect is missing where the model was fitted, and it fails on held-out earthquakes; "
            "fit with these."
        )
    return None if result.stages else "Improvement ended: no further effect is needed."


def _improvement_sentences(result: ImprovementResult) -> Iterator[str]:
    yield from _motion_sentences(result.earthquakes)
    for effect in result.added:
        yield f"Added: {EFFECTS[effect].title} ({effect}). {action(result.model, effect, result.earthquakes)}"
    if not result.added:
        yield "No effect was added; the values were fitted."
    yield from result.ending_text


def _ending_sentences(result: ImprovementResult) -> Iterator[str]:
    yield result.ended
    yield from _left_out_sentences(result)
    yield from gain(result.versions[0], result.versions[-1], result.earthquakes)
    yield from fit_sentences(result.fit, result.inflation)


def _motion_sentences(earthquakes: Earthquakes) -> Iterator[str]:
    """Notes on a displacement that was not measured, each once."""
    notes = [
        finding.message
        for analysis in earthquakes.analyses
        for finding in analysis.quality
        if (finding.kind, finding.severity) == ("displacement", "note")
    ]
    for note in dict.fromkeys(notes):
        yield f"{note[0].upper()}{note[1:]}."


def _left_out_sentences(result: ImprovementResult) -> Iterator[str]:
    if len(result.left_out) < 2:
        return
    first, last = result.left_out[0], result.left_out[-1]
    yield (
        "The error of the force in stronger earthquakes than those fitted changes from "
        f"{percent(first.error_in_stronger)} to {percent(last.error_in_stronger)}, that in earthquakes left out in "
        f"turn from {percent(first.error)} to {percent(last.error)}."
    )
    yield "These also decided which effects were added, so that the error in another one may be a little larger."
    yield "The effects describe the layer, and each may stand in for one that is not known."
    for effect, name in sorted(last.zero):
        meaning = parameter((effect, name)).meaning
        yield (
            f"The term {name} of {effect} ({meaning}) stays 0: no record makes it act, and beyond them it could be "
            "anything."
        )
    yield from _beyond_sentences(result, last)


def _beyond_sentences(result: ImprovementResult, last: Validated) -> Iterator[str]:
    """Sentences about predictions beyond the range of the records."""
    reached, farthest = peak(result.earthquakes.strongest), last.trials[-1]
    worst = max(farthest.errors, key=lambda name: farthest.errors[name])
    if farthest.reach > BEYOND["displacement"]:
        yield (
            f"Fitted to earthquakes of up to {quantity(reached / farthest.reach, 'm')}, the model errs by up to "
            f"{percent(farthest.errors[worst])} in those of up to {quantity(reached, 'm')} ({worst})."
        )
    for one in result.beyond:
        yield (
            f"At {plain(one.times, 2)} times the range fitted, {quantity(one.displacement, 'm')}, a prediction of the "
            f"force may err by {percent(one.error)}: the models fitted to weaker earthquakes differ there by "
            f"{percent(one.spread)} from this one."
        )
    limit = quantity(reached, "m")
    yield f"Beyond {limit} the model's laws are extrapolated, and no record shows how far they are right."


def left_out_tables(result: ImprovementResult) -> tuple[Table, ...]:
    """Errors in the earthquakes left out in turn, a row for each change; none where none was left out."""
    if not result.left_out:
        return ()
    names = result.earthquakes.fitted_names
    rows = tuple(
        (
            _changed(step),
            *(percent(step.errors[name]) for name in names),
            percent(step.error),
            percent(step.error_in_stronger),
        )
        for step in result.left_out
    )
    note = (
        "Root mean square in percent of the force, by the model fitted to the others. Last: that of all, and that in "
        "stronger earthquakes by the model fitted to weaker ones, which decides."
    )
    headings = ("change", *names, "all", STRONGER)
    return (Table("Error of the force in earthquakes left out in turn", headings, rows, note),)


def _changed(step: Validated) -> str:
    if not step.change:
        return BEFORE
    return f"with {step.change}" if step.is_added else f"without {step.change}"
