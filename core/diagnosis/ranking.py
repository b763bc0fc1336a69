"""Ranking of the effects that a model may lack; effects that the records cannot distinguish from the best.

Candidates are compared by BIC = χ²/(s² τ) + p ln(N/τ) (Schwarz 1978): s² is what the best of them leaves over, record
by record, and τ by how much its power exceeds that of white noise where the layer's force lies, so that what a model of
a real building cannot explain does not count as many independent witnesses.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.concurrency import at_once
from core.diagnosis.candidate_search import (
    ReportShare,
    ScoreTest,
    is_excited,
    lower_fit,
    score_tests,
    score_tests_of_forms,
    search_in_parallel,
    unheard,
    unusual_length,
    yields_beside,
)
from core.effects import EFFECTS
from core.errors import ModelError
from core.fitting.data import FitData
from core.fitting.fit import Fit, at_values, finite_fit, fitted, inflation, reweighted_data, rms_by_record
from core.fitting.noise import noise_rms, pooled_rms
from core.fitting.projection import free_parameters
from core.fitting.search import Outcome
from core.model.isolator import Isolator, unusual_forms

DECISIVE = 10.0
"""Difference in BIC that settles a question (Kass and Raftery 1995: very strong from 10 on)."""
ALIKE = 0.02
"""Relative difference of what two models leave over that is no difference. Chosen on even seeds of
benchmarks.diagnosis."""
WORTH = 0.06
"""Smallest share of the residual's power that a supported candidate must explain, however certain it is. Chosen on even
seeds of benchmarks.diagnosis."""
FELT = 0.05
"""The same of the force in N, over its noise, and of the noise's power where less than the noise is left: the residual
of a superstructure's mode at its frequency may be far above the noise there, and is nothing to the layer. Chosen on
even seeds up to 4 of benchmarks.diagnosis: where nothing is hidden, a mass on a spring took up to 0.031."""
ALIKE_DIGITS = 6
"""Decimals of ΔBIC that count in the order of candidates; below lie rounding errors. Chosen on even seeds of
benchmarks.diagnosis."""
SEARCHED = 7
"""Candidates at most whose parameters are searched for; the others stay where their score test was best. Chosen on even
seeds of benchmarks.diagnosis."""
PROMISING = 0.1
"""Share of the best score test's gain from which on another candidate is worth a search,"""
VISIBLE = 0.015
"""and of what is left over, its power. Chosen on even seeds of benchmarks.diagnosis."""

EXPLAINED = 1.04
"""Noise ratio that the best of the simple laws must leave for laws that contain simpler ones, and other forms of laws,
to be tried.

With 10 % noise, laws that were named rightly left up to 1.02, and simpler laws in the place of others 1.03 to 1.10 (odd
seeds of benchmarks.diagnosis). With 1.1 and 1.04 the same was named in twelve trials with even seeds.
"""
FORMS_TRIED = 4
"""Laws, the best first, of which other forms are tried. A choice, for its time."""
FORM_LEAVES = 4.0
"""Noise ratio that a model may leave with a law in another form. Where more is left, the form may be no more than a
stand-in for what is unknown. A choice."""
YIELD_CHANNELS = ("slope", "plasticity", "flow", "sharpness", "growth", "relaxing", "strength")
"""Channels by which effects change how the damper yields."""
PLACES_TRIED = 2
"""Forms, the most promising first, of which a law is searched from their own best place. A choice, for its time."""
SAME = 1e-3
"""Share of the residual's power that is no difference between two fits of the same effects. A choice."""
HELD_WORTH = 0.03
"""Smallest share of the residual's power that another value of a held parameter must take to be kept. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class ScoredCandidate:
    """A candidate against the model without it."""

    effect: str
    fit: Fit
    delta_bic: float
    """ΔBIC of the model with it against that without; the records support it below -DECISIVE."""


@dataclass(frozen=True, slots=True)
class Dropped:
    """A candidate that could not be judged."""

    effect: str
    reason: str
    """In words."""


@dataclass(frozen=True, slots=True, eq=False)
class Ranking:
    """All candidates, the best first."""

    base: Fit
    candidates: tuple[ScoredCandidate, ...]
    data: FitData
    """The records, weighed by what the best leaves over."""
    inflation: float
    """τ."""
    floor: Vector
    """(records,) N, root mean square of the measured force's noise."""
    dropped: tuple[Dropped, ...] = ()
    """Effects that could not be judged, by their names."""
    untried: tuple[str, ...] = ()
    """Laws that contain simpler ones, where these or the model explain the records."""

    @property
    def independent(self) -> float:
        """N/τ, of the coefficients."""
        return self.data.target.size / self.inflation

    def left(self, fit: Fit) -> Vector:
        """(records,) N, root mean square of what a fit leaves over within the band."""
        return rms_by_record(self.data, fit.residual)

    def noise_ratio(self, fit: Fit) -> float:
        """Error that a fit leaves over the error that noise alone makes, each record by its own noise."""
        return noise_ratio(self.data, fit, self.floor)

    @property
    def supported(self) -> tuple[ScoredCandidate, ...]:
        """Candidates that cannot be distinguished from the best one, the best first; none if nothing is missing."""
        best = next(filter(self._is_worth_it, self.candidates), None)
        if best is None or best.delta_bic > -DECISIVE:
            return ()
        return tuple(one for one in self.candidates if self._is_worth_it(one) and _alike(one, best))

    def _is_worth_it(self, one: ScoredCandidate) -> bool:
        before, after = (float(np.sum((self.left(fit) / self.floor) ** 2)) for fit in (self.base, one.fit))
        is_felt = before - after >= FELT * max(before, self.floor.size)
        return is_felt and one.fit.chi_square <= (1 - WORTH) * self.base.chi_square


class Rankings:
    """Rankings that one diagnosis has made, so that none is made twice."""

    def __init__(self, made: Iterable[Ranking]) -> None:
        self._made = {frozenset(one.base.model.effects): one for one in made}

    def add(self, ranking: Ranking) -> Ranking:
        """Keep a ranking, instead of an earlier one with the same effects; returns it."""
        self._made[frozenset(ranking.base.model.effects)] = ranking
        return ranking

    def known(self, model: Isolator, known: Isolator | None) -> Ranking | None:
        """The ranking of a model with the same effects; None if there is none, or if these values lead to a lower
        misfit, so that it may come out otherwise.

        Args:
            model: without the candidates, at values from which a ranking would begin.
            known: the model with one of them, at values that are near its best; None if none is known.
        """
        found = self._made.get(frozenset(model.effects))
        if found is None or _is_lower(found, model, found.base):
            return None
        if known is None:
            return found
        (effect,) = set(known.effects) - set(model.effects)
        own = next((one.fit for one in found.candidates if one.effect == effect), None)
        return None if own is None or _is_lower(found, known, own) else found


def _is_lower(ranking: Ranking, model: Isolator, fit: Fit) -> bool:
    """True if a search from the values of a model leads to a misfit that is lower than that of a fit."""
    return fitted(ranking.data, model).chi_square < (1 - SAME) * fit.chi_square


def ordered(scored: Iterable[ScoredCandidate]) -> tuple[ScoredCandidate, ...]:
    """Candidates from the best on; those whose ΔBIC differ only by rounding errors go by name."""
    return tuple(sorted(scored, key=lambda one: (round(one.delta_bic, ALIKE_DIGITS), one.effect)))


def _alike(one: ScoredCandidate, best: ScoredCandidate) -> bool:
    if one.delta_bic > -DECISIVE:
        return False
    ratio = np.sqrt(one.fit.chi_square / best.fit.chi_square)
    return one.delta_bic - best.delta_bic < DECISIVE or ratio < 1 + ALIKE


def ranked(
    by_noise: FitData,
    model: Isolator,
    effects: Sequence[str],
    known: Isolator | None = None,
    calm: Isolator | None = None,
    report: ReportShare = unheard,
) -> Ranking:
    """Every effect as a candidate, fitted together with the model.

    Laws that contain simpler ones (`special` of Effect) are candidates only where no simple law explains the records,
    which they would follow at the price of a parameter or two, or where the one that does has as many parameters.

    Args:
        by_noise: the records, in the order of their times, weighed by their noise.
        model: without the candidates; its values are where the search begins.
        effects: names of the candidates.
        known: the model with one of them, at values that are near its best; None if none is known.
        calm: some of the model's effects at values from which the search begins where the model's own force grows
            beyond all bounds, since values beside an effect may be too extreme without it; None for no such values.
        report: called with the share of the effects that are tested.

    Raises:
        ModelError: the model's own force grows beyond all bounds, from the calm values too.
    """
    try:
        return _ranked(by_noise, model, effects, known, report)
    except ModelError:
        if calm is None:
            raise
        return _ranked(by_noise, Isolator({**model.effects, **calm.effects}), effects, known, report)


def _ranked(
    by_noise: FitData, model: Isolator, effects: Sequence[str], known: Isolator | None, report: ReportShare
) -> Ranking:
    base = finite_fit(by_noise, model)
    data = reweighted_data(by_noise, base)
    base = finite_fit(data, base.model)
    floor = noise_floor(by_noise)
    own = set() if known is None else set(known.effects) - set(base.model.effects)
    simple = [name for name in effects if name in own or not EFFECTS[name].special]
    seen, fits = _searched(data, base, simple, report, known)
    if not _is_explained(data, base, fits, floor):
        fits |= _beside_the_damper(data, seen, fits)
    contain = _worth_trying([name for name in effects if name not in simple], data, base, fits, floor)
    if contain:
        more, their_fits = _searched(data, base, contain, unheard)
        seen, fits = (*seen, *more), {**fits, **their_fits}
        fits |= _beside_the_damper(data, more, fits)
    judgeable = {name: fit for name, fit in fits.items() if fit.outcome is not Outcome.DIVERGED}
    judgeable |= _in_other_forms(data, base, judgeable, floor)
    judgeable |= _beside_given_yield(data, model, effects, judgeable, floor)
    if judgeable:
        best = min(judgeable.values(), key=lambda fit: fit.chi_square)
        data = reweighted_data(by_noise, at_values(by_noise, best.model))
    base = finite_fit(data, base.model)

    def weighed_anew(fit: Fit) -> Fit:
        return (at_values if fit.outcome is Outcome.STOPPED else fitted)(data, fit.model)

    every = {**fits, **dict(zip(judgeable, at_once(weighed_anew, judgeable.values()), strict=True))}
    every |= {one.effect: at_values(data, one.model) for one, *_ in seen if one.effect not in every}
    final = {name: fit for name, fit in every.items() if fit.outcome is not Outcome.DIVERGED}
    best = min([base, *final.values()], key=lambda fit: fit.chi_square)
    τ = inflation(data, best)
    candidates = [_scored(name, data, base, fit, τ) for name, fit in final.items()]
    return Ranking(
        base,
        ordered(candidates),
        data,
        τ,
        floor,
        tuple(Dropped(name, fit.outcome.value) for name, fit in sorted(every.items()) if name not in final),
        tuple(name for name in effects if name not in every and is_excited(name, data.observations)),
    )


def _searched(
    data: FitData,
    base: Fit,
    effects: Sequence[str],
    report: ReportShare,
    known: Isolator | None = None,
) -> tuple[tuple[tuple[ScoreTest, ...], ...], dict[str, Fit]]:
    """Best places of every effect, and the fits of the promising ones."""
    seen = score_tests(data, base, effects, report)
    if known is not None:
        seen = _from_known(seen, base, known)
    least = max(VISIBLE * base.chi_square, PROMISING * seen[0][0].gain) if seen else 0.0
    promising = [places for n, places in enumerate(seen[:SEARCHED]) if n == 0 or places[0].gain > least]
    return seen, _fits(data, promising)


def _beside_the_damper(data: FitData, seen: Sequence[tuple[ScoreTest, ...]], fits: Mapping[str, Fit]) -> dict[str, Fit]:
    """Fits of the forces that yield beside the damper and were not promising: a damper that was fitted without one has
    taken on a part of it, so that its score test may promise little of what it explains."""
    others = [places for places in seen if yields_beside(places[0].effect) and places[0].effect not in fits]
    return _fits(data, others)


def _fits(data: FitData, every: Sequence[Sequence[ScoreTest]]) -> dict[str, Fit]:
    """Best fit of each effect from its places."""
    models = {places[0].effect: [place.model for place in places] for places in every}
    return dict(search_in_parallel(data, models, [effect for effect in models if yields_beside(effect)]))


def _usual(fits: Mapping[str, Fit]) -> dict[str, Fit]:
    """Fits that did not diverge, of effects whose lengths are usual."""
    usual = {name: fit for name, fit in fits.items() if unusual_length(name, fit.model) is None}
    return {name: fit for name, fit in usual.items() if fit.outcome is not Outcome.DIVERGED}


def _is_explained(data: FitData, base: Fit, fits: Mapping[str, Fit], floor: Vector) -> bool:
    """True if the model, or one of the fits with a usual length, leaves no more than noise."""
    return min(noise_ratio(data, fit, floor) for fit in (base, *_usual(fits).values())) <= EXPLAINED


def _worth_trying(
    contain: Sequence[str], data: FitData, base: Fit, fits: Mapping[str, Fit], floor: Vector
) -> list[str]:
    """Laws to try of those that contain simpler ones.

    All that the records excite, if the model and the simple laws with usual lengths leave more than noise; else the
    peers of the best simple law, and those that slide if it does.
    """
    contain = [name for name in contain if is_excited(name, data.observations)]
    if not _is_explained(data, base, fits, floor):
        return contain
    best = min(_usual(fits), key=lambda name: fits[name].chi_square, default=None)
    return [] if best is None else [name for name in contain if are_peers(name, best) or _both_slide(name, best)]


def _in_other_forms(data: FitData, base: Fit, fits: Mapping[str, Fit], floor: Vector) -> dict[str, Fit]:
    """Fits of the laws that have other forms, each in its best form, if no law in its usual form explains the
    records.

    Another form is searched for from the fit in the usual one and from its own best places, since the values of a form
    that does not suit may lie in a minimum of the misfit that the other form does not leave.
    """
    if not fits or min(noise_ratio(data, fit, floor) for fit in fits.values()) <= EXPLAINED:
        return {}
    τ = inflation(data, min(fits.values(), key=lambda fit: fit.chi_square))
    having = [name for name in fits if EFFECTS[name].forms and is_excited(name, data.observations)]
    having.sort(key=lambda name: fits[name].chi_square)

    def best(name: str) -> Fit:
        places = [one.model for one in score_tests_of_forms(data, base, name)[:PLACES_TRIED]]
        other = in_best_form(data, fits[name], name, τ, places)
        return other if noise_ratio(data, other, floor) <= FORM_LEAVES else fits[name]

    tried = having[:FORMS_TRIED]
    return dict(zip(tried, at_once(best, tried), strict=True))


def _beside_given_yield(
    data: FitData, model: Isolator, effects: Sequence[str], fits: Mapping[str, Fit], floor: Vector
) -> dict[str, Fit]:
    """Fits of effects that change how the damper yields, from the values of the model before it was fitted, if all
    laws leave far more than noise.

    A damper that was fitted without such an effect may have taken on values in whose reach the effect does nothing.
    """
    if not fits or min(noise_ratio(data, fit, floor) for fit in fits.values()) <= FORM_LEAVES:
        return {}
    changing = [name for name in effects if EFFECTS[name].acts_on in YIELD_CHANNELS]
    places = {}
    for name in (one for one in changing if is_excited(one, data.observations)):
        usual = {one.name: one.prior.median for one in EFFECTS[name].parameters}
        places[name] = [Isolator({**model.effects, name: usual})]
    least = min(fit.chi_square for fit in fits.values())
    found = search_in_parallel(data, places, below=least)
    ended = {name: fit for name, fit in found.items() if fit.outcome not in (Outcome.DIVERGED, Outcome.STOPPED)}
    return {name: fit for name, fit in ended.items() if name not in fits or fit.chi_square < fits[name].chi_square}


def in_best_form(
    data: FitData, fit: Fit, effect: str, τ: float, places: Sequence[Isolator] = (), *, whole: bool = False
) -> Fit:
    """The fit with an effect in the form of its law that leaves least; as it is if no other form takes enough more.

    Args:
        data: the records.
        fit: of a model with the effect.
        effect: its name.
        τ: inflation of the residual.
        places: models with other forms at values from which to search, besides those of the fit.
        whole: True to continue each search to its end; see `lower_fit`.
    """
    for name, others in EFFECTS[effect].forms.items():
        values = fit.model.effects[effect]
        changed = [{**values, name: other} for other in others if other != values[name]]
        models = [*places, *(Isolator({**fit.model.effects, effect: one}) for one in changed)]
        fit = lower_fit(data, fit, models, worth_holding(data, fit, τ), elsewhere=effect, whole=whole) or fit
        places = ()
    return fit


def worth_holding(data: FitData, fit: Fit, τ: float) -> float:
    """Reduction of chi-square that is worth holding a parameter at another value."""
    evident = τ * (DECISIVE + float(np.log(data.target.size / τ)))
    return max(evident, HELD_WORTH * fit.chi_square)


def are_peers(contains: str, simple: str) -> bool:
    """True if a law that contains simpler ones is of another law's family, and a fit of it has no more parameters."""
    one, other = EFFECTS[contains], EFFECTS[simple]
    return one.family == other.family and len(one.fitted) <= len(other.fitted)


def _both_slide(one: str, other: str) -> bool:
    """True if both laws slide. Where the vertical load changes little, both leave nearly the same error."""
    return EFFECTS[one].kind == EFFECTS[other].kind == "sliding"


def _from_known(seen: Sequence[tuple[ScoreTest, ...]], base: Fit, known: Isolator) -> tuple[tuple[ScoreTest, ...], ...]:
    """Places to search from, with the known values before all others."""
    (effect,) = set(known.effects) - set(base.model.effects)
    own = next((places for places in seen if places[0].effect == effect), ())
    gain = max((places[0].gain for places in seen), default=0.0)
    return ((ScoreTest(effect, known, gain), *own), *(places for places in seen if places is not own))


def noise_floor(by_noise: FitData) -> Vector:
    """(records,) N, root mean square of the measured force's noise, of records that are weighed by it."""
    return np.array([noise_rms(weights) for weights in by_noise.whitenings])


def noise_ratio(data: FitData, fit: Fit, floor: Vector) -> float:
    """Error that a fit leaves over the error that noise alone makes, each record by its own noise."""
    return pooled_rms(rms_by_record(data, fit.residual) / floor, np.array([w.count for w in data.whitenings]))


def _scored(name: str, data: FitData, base: Fit, fit: Fit, τ: float) -> ScoredCandidate:
    return ScoredCandidate(name, fit, delta_bic(data, base, fit, τ))


def delta_bic(data: FitData, before: Fit, after: Fit, τ: float) -> float:
    """BIC of a fit less that of another, of both to the same data; below −DECISIVE the records support it.

    Args:
        data: the records.
        before: fit of the simpler model.
        after: fit of the other.
        τ: inflation of the residual, by which it counts as fewer independent values.
    """
    more = _determined(after.model) - _determined(before.model)
    return float((after.chi_square - before.chi_square) / τ + more * np.log(data.target.size / τ))


def _determined(model: Isolator) -> int:
    """Number of parameters that the records determine: those that a fit does, and forms that are not the usual ones."""
    unusual = sum(len(unusual_forms(model, effect)) for effect in model.effects)
    return free_parameters(model).count + unusual
