"""Effects added because they predict earthquakes better that the model was not fitted to.

Where something unknown is missing, evidence in the fitted earthquakes does not justify a name: the nearest known effect
is nearly always significant. The force in stronger earthquakes does: the model is fitted to weaker ones and predicts
these. A law that only stands in for others predicts them no better, or worse, though among earthquakes of one
size it may predict each from the others; and once the right ones are there it has lost its worth, and is removed.
benchmarks/extrapolation.py measures this choice against truths that it does not see.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np

from core.arrays import Vector
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
from core.model.force_response import force_response
from core.model.isolator import Isolator, Key
from core.signals.whitening import Whitening
from core.workbench.earthquakes import Earthquakes, peak
from core.workbench.progress import Progress

FEWEST = 2
"""Earthquakes at least: each is predicted by those that are left."""
MOST_ADDED = 10
"""Effects added at most. A choice, for their time."""
SEARCHED = 17
"""Effects at most whose parameters are searched for at each step, those of the best score tests. A choice, for their
time."""
FELT = 0.005
"""Smallest share of the squared residual that an effect takes by its score test to be searched for. A choice."""
VALIDATED = 13
"""Effects at most that are tried on stronger earthquakes, those that leave the least where fitted. A choice, for their
time."""
WEAK = 0.7
"""Largest displacement, over the largest of all, of the earthquakes that are left to predict the others. A choice."""
PREDICTS = 0.97
"""Ratio of the errors in stronger earthquakes, with and without an effect, below which it is added. A choice."""
SPOILS = 1.05
"""Ratio of the errors in earthquakes left out in turn, with and without an effect, above which it is not added. A
choice."""
IDLE = 1.005
"""Ratio of the errors without and with an effect, below which it is removed. A choice."""
LEAST_WORTH = 3
"""Effects whose removal is tried, those that take the least where fitted. A choice, for their time."""
BEYOND_RANGE = (1.5, 2.0)
"""Displacements, over the largest of the fitted earthquakes, for which a prediction's error is given."""
SPREADS = 2.0
"""Factor to the difference between models there. Chosen on the three truths of benchmarks.extrapolation: with 1 the
error at 225 and 312 mm was larger than expected in five of six predictions, with 2 in none."""
FARTHEST = 3.0
"""The same up to which a model must behave as a passive layer does. A choice."""
STEEPEST = 3.0
"""Power of the displacement with which the force may grow at most up to there: that of cubic hardening."""


@dataclass(frozen=True, slots=True)
class Trial:
    """A prediction of earthquakes by the model fitted to weaker ones."""

    fitted_to: tuple[str, ...]
    """Names of these."""
    reach: float
    """Largest displacement of the predicted earthquakes over that of those fitted."""
    errors: Mapping[str, float]
    """By predicted earthquake, error of the force over the force in it."""


@dataclass(frozen=True, slots=True)
class Beyond:
    """Expected error of a prediction beyond the range of the earthquakes that a model was fitted to."""

    times: float
    """Displacement over the largest of these earthquakes."""
    displacement: float
    """m."""
    spread: float
    """Largest difference there between the models fitted to weaker earthquakes and the one fitted to all, over the
    force."""
    error: float
    """Error that is to be expected: of the worst trial, and of SPREADS times this difference."""


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
    trials: tuple[Trial, ...]
    """Predictions of stronger earthquakes by weaker ones, the farthest last."""

    @property
    def error(self) -> float:
        """Root mean square of the errors in earthquakes left out in turn."""
        return _pooled(self.errors.values())

    @property
    def error_in_stronger(self) -> float:
        """Root mean square of the errors in stronger earthquakes."""
        return _in_stronger(self.trials)


def can_validate(earthquakes: Earthquakes) -> bool:
    """True if there are enough earthquakes to leave them out in turn."""
    return len(earthquakes.fitted_names) >= FEWEST


def is_exhausted(steps: Sequence[Validated]) -> bool:
    """True if the search ended because it adds no more than MOST_ADDED effects, not because nothing helps any more."""
    return sum(step.is_added for step in steps[1:]) >= MOST_ADDED


def validated(
    model: Isolator, earthquakes: Earthquakes, given: Collection[str], offered: Collection[str], progress: Progress
) -> Iterator[Validated]:
    """The model, then the model after every change that lowers the error in stronger earthquakes than those fitted.

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
    folds = _Folds(by_noise, first.fit, earthquakes)
    now = folds.validated(first.fit.model, zero, "", is_added=True)
    yield now
    removed = set[str]()
    for number in range(MOST_ADDED):
        progress("trying every effect on stronger earthquakes than fitted", number, MOST_ADDED)
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


def beyond_range(step: Validated, earthquakes: Earthquakes) -> tuple[Beyond, ...]:
    """Expected errors of a model's predictions beyond the range of the earthquakes that it was fitted to.

    Where the motion of the strongest is enlarged, the models that were fitted to weaker ones differ from that fitted to
    all, and the truth differs by more. To this comes the error of the worst trial.

    Args:
        step: the model.
        earthquakes: that it was fitted to.

    Raises:
        ModelError: a model's force grew beyond all bounds.
    """
    by_noise = FitData.by_noise(sorted(earthquakes.fitted, key=lambda one: one.start))
    folds = _Folds(by_noise, finite_fit(by_noise, step.model, step.zero), earthquakes)
    weaker = [fit for names in folds.weak if (fit := folds.fitted_to(names, step.model, step.zero)) is not None]
    worst = max((_pooled(trial.errors.values()) for trial in step.trials), default=inf)
    found = []
    for times in BEYOND_RANGE:
        known = _enlarged(step.model, earthquakes, times)
        others = [_enlarged(fit.model, earthquakes, times) for fit in weaker]
        spread = max((_rms(one - known) / _rms(known) for one in others), default=inf)
        reached = times * peak(earthquakes.strongest)
        found.append(Beyond(times, reached, spread, sqrt(worst**2 + (SPREADS * spread) ** 2)))
    by_noise.memory.clear()
    return tuple(found)


class _Folds:
    """The earthquakes, and these without some of them, weighed by what a model leaves over."""

    def __init__(self, by_noise: FitData, fit: Fit, earthquakes: Earthquakes) -> None:
        at = finite_fit(by_noise, fit.model)
        self.data = reweighted_data(by_noise, at)
        self.earthquakes = earthquakes
        self.names = earthquakes.fitted_names
        self.peaks = {
            name: max(peak(one) for one in earthquakes.fitted if one.name == name) for name in earthquakes.fitted_names
        }
        self.weak = tuple(_weaker(self.peaks))

    def validated(self, model: Isolator, zero: frozenset[Key], change: str, *, is_added: bool) -> Validated:
        """The model after a change, with its errors.

        Args:
            model: fitted to all earthquakes.
            zero: terms that stay 0.
            change: effect that was added or removed.
            is_added: which of both.
        """
        trials = self.trials(model, zero)
        known = dict(trials[0].errors)
        for name in self.names:
            if name not in known:
                others = tuple(other for other in self.names if other != name)
                known |= self._errors(others, (name,), model, zero)
        errors = FrozenDict({name: known[name] for name in self.names})
        return Validated(model, zero, change, is_added, errors, trials)

    def trials(self, model: Isolator, zero: frozenset[Key]) -> tuple[Trial, ...]:
        """Errors in stronger earthquakes than those fitted, infinite where a force grows beyond all bounds.

        Args:
            model: effects, and values to start from.
            zero: terms that stay 0.
        """
        made = []
        for names in self.weak:
            stronger = tuple(name for name in self.names if name not in names)
            reach = max(self.peaks[name] for name in stronger) / max(self.peaks[name] for name in names)
            made.append(Trial(names, reach, self._errors(names, stronger, model, zero)))
        return tuple(made)

    def fitted_to(self, names: Collection[str], model: Isolator, zero: frozenset[Key]) -> Fit | None:
        """Fit to earthquakes alone; None where a force grows beyond all bounds.

        Earthquakes before them move the layer, but weigh nothing.
        """
        whole = self.data
        last = max(row for row, one in enumerate(whole.observations) if one.name in names)
        keeps = any(EFFECTS[effect].carried for effect in model.effects)
        rows = [row for row, one in enumerate(whole.observations) if one.name in names or (keeps and row < last)]
        observations = tuple(whole.observations[row] for row in rows)
        weights = [
            whole.whitenings[row] if whole.observations[row].name in names else _muted(whole.whitenings[row])
            for row in rows
        ]
        excitations = tuple(whole.excitations[row] for row in rows)
        try:
            return finite_fit(FitData(observations, excitations, (), np.zeros(0)).weighed(weights), model, zero)
        except ModelError:
            return None

    def _errors(
        self, kept: Collection[str], predicted: Collection[str], model: Isolator, zero: frozenset[Key]
    ) -> Mapping[str, float]:
        fit, seen = self.fitted_to(kept, model, zero), self.earthquakes
        try:
            forces = () if fit is None else compare_forces(fit.model, seen.fitted, seen.band)
        except ModelError:
            forces = ()
        if not forces:
            return FrozenDict(dict.fromkeys(predicted, inf))
        by_name = {name: [one for one in forces if one.observation.name == name] for name in predicted}
        return FrozenDict({name: float(force_misfit(each).nrmse) for name, each in by_name.items()})


MUTED = 1e6
"""Factor to the noise of an earthquake that weighs nothing."""


def _muted(weights: Whitening) -> Whitening:
    return replace(weights, std=MUTED * weights.std)


def _weaker(peaks: Mapping[str, float]) -> Iterator[tuple[str, ...]]:
    """Earthquakes that predict all others: those but the strongest, and those far weaker than it."""
    in_order = sorted(peaks, key=lambda name: peaks[name])
    yield tuple(in_order[:-1])
    weak = [name for name in in_order[:-1] if peaks[name] <= WEAK * peaks[in_order[-1]]]
    if 0 < len(weak) < len(in_order) - 1:
        yield tuple(weak)


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
    enough = PREDICTS * _in_stronger(folds.trials(now.model, now.zero))
    tried = [(_in_stronger(folds.trials(fits[name].model, now.zero)), name) for name in near[:VALIDATED]]
    for error, name in sorted(tried):
        if error >= enough:
            return None
        weighted, zero = acting_fit(earthquakes.fitted, fits[name].model, now.zero)
        fit = weighted.fit
        if objection(name, fit, earthquakes.fitted) is None and is_sound_beyond(fit.model, earthquakes):
            after = folds.validated(fit.model, zero, name, is_added=True)
            if after.error_in_stronger < enough and after.error < SPOILS * now.error:
                return after
    return None


def _without_idle(now: Validated, kept: Collection[str], folds: _Folds, earthquakes: Earthquakes) -> Validated | None:
    """The model without the effect that is worth least, if it predicts as well without; None if all are worth it."""
    fewer: dict[str, Fit] = {}
    for name in sorted(set(now.model.effects) - set(kept)):
        less = Isolator({other: values for other, values in now.model.effects.items() if other != name})
        try:
            fewer[name] = finite_fit(folds.data, less, _without(now.zero, name))
        except ModelError:
            continue
    idle = IDLE * _in_stronger(folds.trials(now.model, now.zero)) if fewer else 0.0
    for name in sorted(fewer, key=lambda name: fewer[name].chi_square)[:LEAST_WORTH]:
        zero = _without(now.zero, name)
        if _in_stronger(folds.trials(fewer[name].model, zero)) < idle:
            weighted, zero = acting_fit(earthquakes.fitted, fewer[name].model, zero)
            return folds.validated(weighted.fit.model, zero, name, is_added=False)
    return None


def _without(zero: frozenset[Key], effect: str) -> frozenset[Key]:
    return frozenset(key for key in zero if key[0] != effect)


def is_sound_beyond(model: Isolator, earthquakes: Earthquakes) -> bool:
    """True if a model acts as a passive layer in the strongest earthquake's motion enlarged FARTHEST times.

    Its force is finite, takes up energy, opposes the displacement, and grows by no more than its power STEEPEST.

    Args:
        model: fitted to the earthquakes.
        earthquakes: those held out are not looked at.
    """
    layer = earthquakes.strongest.layer
    try:
        usual, far = (_enlarged(model, earthquakes, times) for times in (1.0, FARTHEST))
    except ModelError:
        return False
    opposes, takes_up = far @ layer.displacement > 0, far @ layer.velocity > 0
    return bool(opposes and takes_up and _rms(far) < FARTHEST**STEEPEST * _rms(usual))


def _enlarged(model: Isolator, earthquakes: Earthquakes, times: float) -> Vector:
    """(n,) N, force of a new layer under the strongest earthquake's motion enlarged.

    Raises:
        ModelError: it grew beyond all bounds.
    """
    one = earthquakes.strongest
    u, v = times * one.layer.displacement, times * one.layer.velocity
    force = force_response(model, u, v, one.rate, conditions=one.conditions).force
    if not np.isfinite(force).all():
        raise ModelError(f"beyond {peak(one):g} m the model's force grows beyond all bounds; leave an effect out")
    return force


def _in_stronger(trials: Sequence[Trial]) -> float:
    return _pooled([error for trial in trials for error in trial.errors.values()])


def _pooled(errors: Collection[float]) -> float:
    return sqrt(sum(one**2 for one in errors) / len(errors))


def _rms(force: Vector) -> float:
    return float(np.sqrt(np.mean(force**2)))
