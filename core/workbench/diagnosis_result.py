"""Result of a diagnosis: its sentences, and the table of the effects that were tried."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from types import MappingProxyType

from core.comparison.misfit import Misfit
from core.diagnosis.building_faults import FLOOR_SHARE, TOTAL_MASS
from core.diagnosis.effect_search import ABOVE_NOISE
from core.diagnosis.missing_effects import Diagnosis, Outcome
from core.diagnosis.naming import CLOSE
from core.diagnosis.plausibility import objection
from core.diagnosis.ranking import DECISIVE, Dropped
from core.diagnosis.sensor_faults import IN_USE, BuildingFault, Cause
from core.diagnosis.worth import NoiseRatios, worth
from core.effects import EFFECTS
from core.fitting.fit import Fit
from core.fitting.idle_terms import CERTAIN
from core.model.isolator import Isolator, parameter
from core.rounding import plain
from core.tables import Table, report
from core.units import percent, quantity
from core.workbench.candidates import Candidate, Stage
from core.workbench.comparing import ComparisonResult, counted
from core.workbench.directions import DirectionDiagnosis, direction_sentences
from core.workbench.earthquakes import HELD_OUT, Earthquakes, Version
from core.workbench.fitting import deviations
from core.workbench.out_of_range import OutOfRange, range_sentences
from core.workbench.tables import Deviations, gain, values_table, version_tables
from core.workbench.texts import (
    evidence,
    lowers_error,
    missing,
    remaining,
    resembling,
    temperature_sentences,
    titled,
    unexplained_share,
)

RUNNERS_UP = 2
"""Number of effects that are named although something speaks against them."""
BRIEF = 8
"""Candidates in a printed report, the best first."""
CALLED = MappingProxyType({Cause.SENSOR: "The sensor {}", Cause.SUPERSTRUCTURE: "The superstructure"})
"""Openings of the sentences on faults but those of masses, by cause."""
MASSES = MappingProxyType(
    {
        FLOOR_SHARE: "The masses in the building file do not fit",
        TOTAL_MASS: "The masses in the building file may not fit",
    }
)
"""Openings of the sentences on faults of masses, by kind."""
BESIDE_A_FAULT = frozenset({Outcome.EFFECT, Outcome.ONE_OF_SET, Outcome.FAMILY, Outcome.UNKNOWN, Outcome.OUT_OF_RANGE})
"""Outcomes that a fault does not explain once it is corrected, or its sensor left out."""
IMPOSSIBLE, DOUBTFUL = "impossible", "doubtful"
"""Why an effect is not proposed."""


@dataclass(frozen=True, slots=True, eq=False)
class DiagnosisResult:
    """A model, the effects that it lacks, and the errors of every version."""

    given: Isolator
    model: Isolator
    """The model with all effects that were added, named or not, its values rounded to six digits."""
    earthquakes: Earthquakes
    diagnosis: Diagnosis
    refitted: ComparisonResult
    """Comparison of the given effects at fitted values with all earthquakes."""
    candidates: tuple[Candidate, ...]
    """Effects that were tried on the refitted model, the best first."""
    faults: tuple[BuildingFault, ...]
    """Faults of sensors, superstructure and masses."""
    stages: tuple[Stage, ...]
    """One for each effect that was added; if the outcome is unknown, for each that is near to what is missing."""
    versions: tuple[Version, ...]
    """The model as given, refitted, then those of the stages."""
    out_of_range: tuple[OutOfRange, ...] = ()
    """Held-out earthquakes in which the last version fails although it fits the others."""
    directions: tuple[DirectionDiagnosis, ...] = ()
    """Diagnoses of each direction by itself; none where only one was looked at."""
    diverging: tuple[Dropped, ...] = ()
    """Effects whose force grew beyond all bounds in a held-out earthquake."""

    @property
    def dropped(self) -> tuple[Dropped, ...]:
        """Effects that could not be judged, with the reason."""
        return (*self.diagnosis.dropped, *self.diverging)

    @property
    def before(self) -> Misfit:
        """N, of the refitted model's force where it was fitted."""
        return self.versions[1].error(self.earthquakes.fitted_names)

    @property
    def outcome(self) -> str:
        """Outcome in one word: what the layer's model lacks, or the fault of the building that explains its error."""
        cause = decisive_cause(self.faults, self.diagnosis.outcome)
        return self.diagnosis.outcome.value if cause is None else cause.value

    @property
    def resembles(self) -> tuple[str, ...]:
        """Names of the effects that are nearest to something unknown, the nearest first; none for other outcomes."""
        if self.diagnosis.outcome is not Outcome.UNKNOWN or self.diagnosis.resembles:
            return self.diagnosis.resembles
        nearest = _nearest_candidate(self)
        return () if nearest is None else (nearest.effect,)

    @property
    def std(self) -> Deviations:
        """Standard deviations of the model's values by effect and parameter, SI units."""
        fit, inflation = last_fit(self.diagnosis, self.stages)
        return deviations(fit, inflation)

    @property
    def text(self) -> tuple[str, ...]:
        """Sentences: what is missing, the worth of adding it, what is open and which records would decide it."""
        opening = OPENINGS.get(self.diagnosis.outcome, _missing)(self)
        outside = () if self.diagnosis.outcome is Outcome.OUT_OF_RANGE else range_sentences(self.out_of_range)
        apart = direction_sentences(self.directions)
        told = (*opening, *apart, *_after(self), *outside, *_open(self), *_untried(self), *_dropped(self))
        return (*fault_sentences(self.faults), *told)

    def __str__(self) -> str:
        versions = (*self.versions[:2], *self.versions[2:][-1:])
        tables = [candidate_table(self, self.candidates[:BRIEF]), *version_tables(versions, self.earthquakes)]
        tables += [values_table(self.model, self.std)] if self.stages else []
        title = f"Diagnosis of {', '.join(self.given.effects)} by {counted(self.earthquakes)}"
        return report(title, self.text, *tables)


def last_fit(diagnosis: Diagnosis, staged: Sequence[Stage]) -> tuple[Fit, float]:
    """Fit of the model with the effects of all these stages, and the inflation of its variances."""
    return (staged[-1].fit, staged[-1].inflation) if staged else (diagnosis.refitted, diagnosis.first.inflation)


def first_cause(faults: Sequence[BuildingFault]) -> Cause | None:
    """The fault that must be repaired first; None if there is none."""
    return next((cause for cause in Cause if any(one.cause is cause for one in faults)), None)


def decisive_cause(faults: Sequence[BuildingFault], outcome: Outcome) -> Cause | None:
    """The fault that explains the model's error; None if there is none, or if an effect is missing besides.

    A sensor explains the error if it is still in use as it errs, or if no effect is missing once it is corrected or
    left out; so do masses for which the forces were corrected. A storey and the total mass always do.
    """
    others = [one for one in faults if one.cause is not Cause.SENSOR and not one.is_corrected]
    in_use = [one for one in faults if one.cause is Cause.SENSOR and one.kind in IN_USE and not one.is_corrected]
    if in_use or outcome not in BESIDE_A_FAULT:
        return first_cause(faults)
    return first_cause(others)


def fault_sentences(faults: Sequence[BuildingFault]) -> tuple[str, ...]:
    """Sentences on faults of sensors, superstructure and masses; none without a fault."""
    each = tuple(f"{_called(one)}: {one.message.rstrip('.')}." for one in faults)
    if not each:
        return ()
    corrected = [one for one in faults if one.is_corrected]
    if not corrected:
        return (*each, "Correct this first: it may cause the findings on the isolation layer below.")
    return (*each, *_corrected([one.channel for one in corrected if one.channel is not None], corrected))


def _called(fault: BuildingFault) -> str:
    return MASSES[fault.kind] if fault.cause is Cause.MASS else CALLED[fault.cause].format(fault.channel)


def _corrected(channels: Sequence[str], faults: Sequence[BuildingFault]) -> Iterator[str]:
    """Sentences on what was corrected before the layer was judged."""
    if channels:
        yield (
            f"The records were corrected for this in a copy ({', '.join(dict.fromkeys(channels))}), which the findings "
            "on the isolation layer below come from. Correct it before you fit a model."
        )
    if any(one.cause is Cause.MASS for one in faults):
        yield (
            "The findings on the isolation layer below come from forces for the masses of the records. Correct the "
            "building file before you fit a model."
        )


def candidate_table(result: DiagnosisResult, tried: Sequence[Candidate]) -> Table:
    """Effects that were tried on the refitted model, the best first.

    Args:
        result: the diagnosis.
        tried: the candidates to show.
    """
    without, groups = result.versions[1], result.earthquakes.groups
    errors = [percent(without.error(names).nrmse) for names in groups.values()]
    ratio = result.diagnosis.first.noise_ratio(result.diagnosis.refitted)
    return Table(
        "Effects tried, each added alone and the whole model refitted",
        ("effect", "family", "error", *(["held out"] if HELD_OUT in groups else []), "noise ratio", "ΔBIC", "remark"),
        (("none", "", *errors, f"{ratio:.3g}", "0", ""), *_candidate_rows(tried)),
        "Error: of the force, root mean square in percent of it. ΔBIC below −10: the records support the effect.",
        sums=0,
        texts=("family", "remark"),
    )


def _candidate_rows(tried: Sequence[Candidate]) -> Iterator[tuple[str, ...]]:
    for one in tried:
        outside = [] if one.after_held_out is None else [percent(one.after_held_out.nrmse)]
        remark = one.implausible or ("best, or cannot be distinguished from it" if one.in_set else "")
        size = (percent(one.after.nrmse), *outside, f"{one.noise_ratio:.3g}")
        yield (one.effect, one.family, *size, plain(one.delta_bic, 3), remark)


def _nothing(result: DiagnosisResult) -> Iterator[str]:
    yield f"No known effect is missing: {_size(result)}, and no effect takes enough of that away."
    yield from _nearest(result)


def _refit(result: DiagnosisResult) -> Iterator[str]:
    yield "No known effect is missing, but the values are wrong: fit the model."
    yield f"Fitted, {_size(result)}."
    yield from _nearest(result)


def _missing(result: DiagnosisResult) -> Iterator[str]:
    final, _ = last_fit(result.diagnosis, result.stages)
    for number in range(1, len(result.stages) + 1):
        added, versions = result.stages[:number], result.versions[1 : number + 2]
        yield from missing(added, versions, result.given, result.earthquakes, final, result.std)
    yield from temperature_sentences([one.effect for one in result.stages], result.earthquakes)
    if result.diagnosis.outcome is Outcome.FAMILY and all(len(one.step.alike) == 1 for one in result.stages):
        families = " and ".join(sorted({EFFECTS[one.effect].family for one in result.stages}))
        yield f"Only the family, {families}, is certain: the law itself leaves more than the noise."


def _unknown(result: DiagnosisResult) -> Iterator[str]:
    yield f"Something is missing that no known effect explains: fitted, {_size(result)}."
    if result.diagnosis.resembles:
        yield from resembling((*result.diagnosis.steps, *result.diagnosis.idle))
    else:
        yield from _nearest(result)
    yield from temperature_sentences(result.resembles, result.earthquakes)
    yield unexplained_share(result.diagnosis.explained)
    yield from result.refitted.text[1:2]


def _out_of_range(result: DiagnosisResult) -> Iterator[str]:
    yield f"The model fits what it was fitted to and fails beyond its range: where fitted, {_size(result)}."
    yield from range_sentences(result.out_of_range)
    yield from _nearest(result)


OPENINGS = MappingProxyType(
    {
        Outcome.NOTHING_MISSING: _nothing,
        Outcome.REFIT: _refit,
        Outcome.UNKNOWN: _unknown,
        Outcome.OUT_OF_RANGE: _out_of_range,
    }
)
"""First sentences of outcomes without a name; the others name what is missing."""


def _after(result: DiagnosisResult) -> Iterator[str]:
    steps = result.diagnosis.steps
    if steps:
        yield from gain(result.versions[1], result.versions[-1], result.earthquakes)
    if result.diagnosis.named:
        yield unexplained_share(result.diagnosis.explained)
    if steps and result.diagnosis.unexplained.is_there:
        yield remaining(result.diagnosis.unexplained, len(steps))
    if result.diagnosis.named:
        yield from _replaced(result)


def _replaced(result: DiagnosisResult) -> Iterator[str]:
    """Effects of the given model of which nothing is left: what was named has their place rather than one beside it."""
    added = " and ".join(titled(stage.effect) for stage in result.stages)
    for effect in result.given.effects:
        for one in EFFECTS[effect].linear:
            value, std = result.model.effects[effect][one], result.std.get(effect, {}).get(one)
            if std and isfinite(std) and abs(value) < CERTAIN * std:
                size = quantity(value, parameter((effect, one)).unit, std)
                yield f"With {added}, nothing is left of {titled(effect)}, which is replaced: {one} is {size}."


def _open(result: DiagnosisResult) -> Iterator[str]:
    """Effects that may be meant although something speaks against them, and undetermined effects."""
    named = {stage.effect for stage in result.stages}
    strange = [one for one in result.candidates if one.effect not in named and one.implausible]
    for one in [one for one in strange if _may_be_meant(one, result)][:RUNNERS_UP]:
        against = objection(one.effect, one.fit, result.earthquakes.fitted)
        verdict = IMPOSSIBLE if against is not None and against.is_impossible else DOUBTFUL
        yield f"Not proposed because it is {verdict}: {titled(one.effect)}; {one.implausible}."
    unseen = ", ".join(dict.fromkeys(name for name, _ in result.diagnosis.refitted.undetermined))
    if unseen:
        yield f"Not determined by these records: {unseen}."


def _may_be_meant(one: Candidate, result: DiagnosisResult) -> bool:
    """True if the model leaves more than noise, and an effect would earn a name by itself, leaves little more than the
    best against which nothing speaks, and does not raise the error in held-out earthquakes."""
    left, out = result.diagnosis.before, result.earthquakes.groups.get(HELD_OUT, ())
    if one.delta_bic >= -DECISIVE or not (left.is_there or left.noise_ratio > ABOVE_NOISE):
        return False
    if one.after_held_out is not None and lowers_error(one.after_held_out, result.versions[1].error(out)):
        return False  # it raises the error
    best = min((other.noise_ratio for other in result.candidates if not other.implausible), default=inf)
    before, after = (NoiseRatios(ratio, held_out=None) for ratio in (left.noise_ratio, one.noise_ratio))
    return worth(before, after).earns_a_name and one.noise_ratio <= CLOSE * max(best, 1.0)


def _untried(result: DiagnosisResult) -> Iterator[str]:
    untried = ", ".join(titled(name) for name in result.diagnosis.untried)
    if untried:
        yield f"Not tried, because the records are explained without them: {untried}."


def _dropped(result: DiagnosisResult) -> Iterator[str]:
    for one in result.dropped:
        yield f"{titled(one.effect)} could not be checked: {one.reason}."


def _nearest(result: DiagnosisResult) -> Iterator[str]:
    """The nearest effect, or that there is none."""
    best = _nearest_candidate(result)
    if best is None:
        if result.candidates:
            yield "No plausible effect lowers the error of the force."
        return
    yield f"The nearest known effect is {titled(best.effect)}."
    yield evidence(best.effect, result.before, best.after, best.delta_bic)


def _nearest_candidate(result: DiagnosisResult) -> Candidate | None:
    """The best effect that lowers the error and that nothing speaks against."""
    plausible = (one for one in result.candidates if not one.implausible and lowers_error(result.before, one.after))
    return next(plausible, None)


def _size(result: DiagnosisResult) -> str:
    fitted = result.versions[1].errors.of(result.earthquakes.fitted_names)
    rms, share = plain(result.before.rms * 1e-3, 3), percent(result.before.nrmse)
    return (
        f"the error of the force is {rms} kN, {share} of the force and {plain(fitted.noise_ratio, 3)} times the noise "
        "floor"
    )
