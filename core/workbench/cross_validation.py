"""Effects added because they predict earthquakes better that they were not fitted to: each is left out in turn.

Where something unknown is missing, evidence in the fitted earthquakes does not justify a name: the nearest known effect
is nearly always significant. The force in an earthquake that was left out does: a law that only stands in for others
predicts it no better, or worse; and once the right ones are there it has lost its worth, and is removed. The strongest
earthquake is left out too, so that a law which goes astray beyond the range that it was fitted to is not added.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from core.comparison.compared import compare_forces, force_misfit
from core.diagnosis.candidate_search import is_excited, score_tests, search_in_parallel
from core.diagnosis.plausibility import objection
from core.effects import EFFECTS
from core.errors import ModelError
from core.fitting.data import FitData
from core.fitting.fit import Fit, finite_fit, reweighted_data
from core.fitting.idle_terms import acting_fit
from core.fitting.search import Outcome
from core.frozen import FrozenDict
from core.model.isolator import Isolator, Key
from core.workbench.earthquakes import Earthquakes, Progress

FEWEST = 2
"""Earthquakes at least: each is predicted by those that are left."""
MOST_ADDED = 10
"""Effects added at most. A choice, for their time."""
SEARCHED = 14
"""Effects at most whose parameters are searched for at each step, those of the best score tests. A choice, for their
time."""
FELT = 0.005
"""Smallest share of the squared residual that an effect takes by its score test to be searched for. A choice."""
VALIDATED = 10
"""Effects at most that are tried on earthquakes left out, those that leave the least where fitted. A choice, for their
time."""
PREDICTS = 0.985
"""Ratio of the errors in the earthquakes left out, with and without an effect, below which it is added. A choice."""
IDLE = 1.002
"""Ratio of the errors without and with an effect, below which it is removed. A choice."""


@dataclass(frozen=True, slots=True)
class Validated:
    """A model after one change, and how well it predicts."""

    model: Isolator
    """Its values fitted to all earthquakes."""
    zero: frozenset[Key]
    """Terms of its effects that no record makes act: they stay 0."""
    change: str
    """Name of the effect that was added or removed; empty for the model that all begins with."""
    is_added: bool
    errors: Mapping[str, float]
    """By earthquake, error of the force over the force in it, by the model fitted to the others."""

    @property
    def error(self) -> float:
        """Root mean square of the errors."""
        return _pooled(self.errors)


def can_validate(earthquakes: Earthquakes) -> bool:
    """True if there are enough earthquakes to leave them out in turn."""
    return len(earthquakes.fitted_names) >= FEWEST


def is_exhausted(steps: Sequence[Validated]) -> bool:
    """True if the search ended because it adds no more than MOST_ADDED effects, not because nothing helps any more."""
    return sum(step.is_added for step in steps[1:]) >= MOST_ADDED


def validated(
    model: Isolator, earthquakes: Earthquakes, given: Collection[str], offered: Collection[str], progress: Progress
) -> Iterator[Validated]:
    """The model, then the model after every change that lowers the error in the earthquakes left out.

    Args:
        model: to begin with.
        earthquakes: those held out are not looked at.
        given: effects that are never removed.
        offered: names of the effects that may be added. One that acts at an instant never is: another earthquake
            cannot confirm it.
        progress: called with each step.

    Raises:
        ModelError: the model's force grew beyond all bounds.
    """
    by_noise = FitData.by_noise(sorted(earthquakes.fitted, key=lambda one: one.start))
    lasting = {name for name in offered if not any(one.is_instant for one in EFFECTS[name].parameters)}
    first, zero = acting_fit(earthquakes.fitted, model)
    fitted = first.fit
    folds = _Folds(by_noise, fitted, earthquakes)
    now = Validated(fitted.model, zero, "", True, folds.errors(fitted.model, zero))
    yield now
    removed = set[str]()
    for number in range(MOST_ADDED):
        progress("trying every effect on earthquakes left out", number, MOST_ADDED)
        names = sorted(lasting - set(now.model.effects) - removed)
        better = _extended(now, names, folds, earthquakes)
        if better is None:
            break
        yield better
        fitted = acting_fit(earthquakes.fitted, better.model, better.zero)[0].fit
        now, folds = better, _Folds(by_noise, fitted, earthquakes)
        while (fewer := _without_idle(now, {*given, better.change}, folds, earthquakes)) is not None:
            removed.add(fewer.change)
            yield fewer
            now = fewer
    by_noise.memory.clear()


class _Folds:
    """The earthquakes, and these without each of them, weighed by what a model leaves over."""

    def __init__(self, by_noise: FitData, fit: Fit, earthquakes: Earthquakes) -> None:
        at = finite_fit(by_noise, fit.model)
        self.data = reweighted_data(by_noise, at)
        self.earthquakes = earthquakes
        seen = range(len(by_noise.observations))
        self.kept = {
            name: [n for n in seen if by_noise.observations[n].name != name] for name in earthquakes.fitted_names
        }

    def errors(self, model: Isolator, zero: frozenset[Key]) -> Mapping[str, float]:
        """By earthquake, error of the force over the force in it, by the model fitted to the others; infinite where a
        force grows beyond all bounds.

        Args:
            model: effects, and values to start from.
            zero: terms that stay 0.
        """
        return FrozenDict({name: self._error(name, model, zero) for name in self.kept})

    def _error(self, name: str, model: Isolator, zero: frozenset[Key]) -> float:
        whole, rows = self.data, self.kept[name]
        observations = tuple(whole.observations[row] for row in rows)
        excitations = tuple(whole.excitations[row] for row in rows)
        others = FitData(observations, excitations, (), np.zeros(0)).weighed([whole.whitenings[row] for row in rows])
        try:
            fit = finite_fit(others, model, zero)
            forces = compare_forces(fit.model, self.earthquakes.fitted, self.earthquakes.band)
        except ModelError:
            return inf
        return float(force_misfit([one for one in forces if one.observation.name == name]).nrmse)


def _extended(now: Validated, names: Collection[str], folds: _Folds, earthquakes: Earthquakes) -> Validated | None:
    """The model with the effect that predicts best; None if none predicts better than the model without.

    An effect against which something speaks, such as a value that no record determines, is none.
    """
    base = finite_fit(folds.data, now.model, now.zero)
    excited = [name for name in names if is_excited(name, earthquakes.fitted)]
    tests = [places for places in score_tests(folds.data, base, excited) if places[0].gain > FELT * base.chi_square]
    fits = search_in_parallel(
        folds.data, {places[0].effect: [one.model for one in places] for places in tests[:SEARCHED]}
    )
    finite = [name for name, fit in fits.items() if fit.outcome is not Outcome.DIVERGED]
    near = sorted(finite, key=lambda name: fits[name].chi_square)
    enough = PREDICTS * _pooled(folds.errors(now.model, now.zero))
    tried = [(_pooled(folds.errors(fits[name].model, now.zero)), name) for name in near[:VALIDATED]]
    for error, name in sorted(tried):
        if error >= enough:
            return None
        weighted, zero = acting_fit(earthquakes.fitted, fits[name].model, now.zero)
        fit = weighted.fit
        if objection(name, fit, earthquakes.fitted) is None:
            errors = folds.errors(fit.model, zero)
            if _pooled(errors) < enough:
                return Validated(fit.model, zero, name, True, errors)
    return None


def _without_idle(now: Validated, kept: Collection[str], folds: _Folds, earthquakes: Earthquakes) -> Validated | None:
    """The model without the effect that is worth least, if it predicts as well without; None if all are worth it."""
    fewer: dict[str, Fit] = {}
    for name in sorted(set(now.model.effects) - set(kept)):
        less = Isolator({other: values for other, values in now.model.effects.items() if other != name})
        try:
            fewer[name] = finite_fit(folds.data, less, now.zero)
        except ModelError:
            continue
    if not fewer:
        return None
    least = min(fewer, key=lambda name: fewer[name].chi_square)
    zero = frozenset(key for key in now.zero if key[0] != least)
    if _pooled(folds.errors(fewer[least].model, zero)) >= IDLE * _pooled(folds.errors(now.model, now.zero)):
        return None
    weighted, zero = acting_fit(earthquakes.fitted, fewer[least].model, zero)
    fitted = weighted.fit.model
    return Validated(fitted, zero, least, False, folds.errors(fitted, zero))


def _pooled(errors: Mapping[str, float]) -> float:
    return sqrt(sum(one**2 for one in errors.values()) / len(errors))
