"""Fit of a model's values to earthquakes, and the sentences that a fit needs."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import inf, sqrt

import numpy as np

from core.diagnosis.effect_search import LOWERS
from core.fitting.fit import Fit
from core.fitting.idle_terms import acting_fit, terms_at_zero
from core.fitting.observation import Observation
from core.fitting.search import Outcome
from core.frozen import FrozenDict
from core.model.isolator import Isolator, Key, parameter
from core.rounding import plain
from core.tables import report
from core.units import shown, unit
from core.workbench.comparing import counted
from core.workbench.earthquakes import Earthquakes, Version, model_errors
from core.workbench.progress import Progress, silent
from core.workbench.tables import Deviations, gain, values_table, version_tables

DIGITS = 6
"""Digits of a fitted value: records determine no more, and a file of such values is readable."""
CLOSE = 0.95
"""Correlation of two values, from which on the records barely separate them. A choice."""
VAGUE = 0.5
"""Standard deviation over value, from which on a value is barely known. A choice."""
MOST_PAIRS = 3
"""Number of correlated pairs that are named."""
RAISED = (
    "The error rises because a fit weighs each frequency and each earthquake by its noise: where a model leaves far "
    "more than noise, what the quiet ones need spoils the others. Something is missing: diagnose the model, or keep "
    "the values as given."
)
"""Sentence on a fit that leaves a larger error than the model had as given."""


@dataclass(frozen=True, slots=True, eq=False)
class FitResult:
    """A model with its values fitted to the records."""

    given: Isolator
    model: Isolator
    """The fitted model, its values rounded to six digits."""
    fit: Fit
    inflation: float
    """Ratio of the variances to those that the measurement's noise alone would cause."""
    earthquakes: Earthquakes
    versions: tuple[Version, ...]
    """The model as given, and fitted."""
    zero: frozenset[Key] = frozenset()
    """Terms that were 0 in the model as given, and that no record makes act: they stay 0."""

    @property
    def std(self) -> Deviations:
        """Standard deviations by effect and parameter, SI units; infinite where the records leave a value open."""
        return deviations(self.fit, self.inflation)

    @property
    def fit_text(self) -> tuple[str, ...]:
        """Sentences on how the fit ended, on what weakens it, and on terms that stay 0."""
        return (*fit_sentences(self.fit, self.inflation), *_zero_sentences(self.zero))

    @property
    def text(self) -> tuple[str, ...]:
        """The same, with the change of the error."""
        before, after = self.versions
        was, now = (version.error(self.earthquakes.fitted_names).rms for version in self.versions)
        why = (RAISED,) if was < LOWERS * now else ()
        return (*self.fit_text, *gain(before, after, self.earthquakes), *why)

    def __str__(self) -> str:
        title = f"Fit of {', '.join(self.model.effects)} to {counted(self.earthquakes)}"
        tables = (values_table(self.model, self.std), *version_tables(self.versions, self.earthquakes))
        return report(title, *tables, self.text)


def fit(
    model: Isolator,
    earthquakes: Earthquakes | Sequence[Observation],
    *,
    hold_out: Collection[str] = (),
    progress: Progress = silent,
) -> FitResult:
    """Fit the values of all effects of a model to all earthquakes but those held out.

    A term that is 0 beside another amplitude of its effect, as `improve` leaves it, stays 0 unless the records make it
    act.

    Args:
        model: effects, and values to start from.
        earthquakes: observations of one building.
        hold_out: names of the earthquakes that only test the result.
        progress: called with each step.

    Raises:
        RecordError: no observation is left to fit to.
        ModelError: the model's force grew beyond all bounds.
    """
    seen = Earthquakes.of(earthquakes, hold_out)
    progress("fitting", 0, 2)
    weighted, zero = acting_fit(seen.fitted, model, among=terms_at_zero(model))
    fitted = readable(weighted.fit.model)
    progress("driving the model by the motion and by the ground alone", 1, 2)
    versions = (Version("as given", model_errors(model, seen)), Version("fitted", model_errors(fitted, seen)))
    progress("fitted", 2, 2)
    return FitResult(model, fitted, weighted.fit, weighted.inflation, seen, versions, zero)


def readable(model: Isolator) -> Isolator:
    """The same model, its values rounded to six digits."""
    return Isolator(
        {
            name: {key: float(f"{value:.{DIGITS}g}") for key, value in values.items()}
            for name, values in model.effects.items()
        }
    )


def deviations(fit: Fit, inflation: float) -> Deviations:
    """Standard deviations by effect and parameter, to three digits; infinite where the records leave the value open."""
    by_effect: dict[str, dict[str, float]] = {}
    for (effect, name), std in fit.std.items():
        lost = (effect, name) in fit.undetermined
        by_effect.setdefault(effect, {})[name] = inf if lost else float(f"{std * sqrt(inflation):.3g}")
    return FrozenDict({effect: FrozenDict(values) for effect, values in by_effect.items()})


def fit_sentences(fit: Fit, inflation: float) -> tuple[str, ...]:
    """Sentences on how a fit ended and which values the records do not determine, the most important first.

    Args:
        fit: of a model.
        inflation: of its variances.
    """
    return tuple(_sentences(fit, inflation))


def _sentences(fit: Fit, inflation: float) -> Iterator[str]:
    yield ENDINGS[fit.outcome]
    if ends := list(_ends(fit)):
        yield f"At the end of its range: {'; '.join(ends)}. The effect may be absent, or another may be missing."
    if fit.undetermined:
        yield (
            f"Not determined: {_names(fit.undetermined)}. The other values can do all that it does, or no record made "
            "it act; its value is only a start. Records of larger motion or other conditions would help, or the model "
            "without it."
        )
    if vague := [key for key in _determined(fit) if _std(fit, key, inflation) > VAGUE * abs(_value(fit, key))]:
        yield f"Uncertain by half of its value or more: {_names(vague)}."
    if close := _close(fit):
        pairs = "; ".join(f"{one} and {other} ({ρ:+.3f})" for one, other, ρ in close[:MOST_PAIRS])
        yield f"Strongly correlated, barely distinguishable: {pairs}."


def _zero_sentences(zero: frozenset[Key]) -> Iterator[str]:
    for key in sorted(zero):
        yield (
            f"The term {key[1]} of {key[0]} ({parameter(key).meaning}) is 0 in the model and stays 0: no record makes "
            "it act. Another value in the model's file sets it free."
        )


ENDINGS = {
    Outcome.SETTLED: "Fitted: the misfit has a minimum here.",
    Outcome.AT_BOUND: "Fitted, but a parameter went to the end of its range.",
    Outcome.UNDETERMINED: "Fitted in part: the records do not determine every parameter.",
    Outcome.STOPPED: "Not fitted: the search was stopped before it settled.",
    Outcome.DIVERGED: "Not fitted: the model's force, or its derivatives, grew beyond all bounds.",
}
"""Sentences on how a fit ended, by outcome."""


def _ends(fit: Fit) -> Iterator[str]:
    for key in _determined(fit):
        about, value = parameter(key), _value(fit, key)
        if value in about.bounds:
            number = f"{plain(shown(value, about.unit), 3)} {unit(about.unit)}".rstrip()
            if value == about.bounds[0]:
                yield f"{_name(key)}, {number}, the smallest that it may be"
            else:
                yield f"{_name(key)}, {number}, the largest that it may be"


def _close(fit: Fit) -> list[tuple[str, str, float]]:
    std = np.sqrt(np.diag(fit.covariance))
    kept = [row for row, key in enumerate(fit.free) if key not in fit.undetermined and std[row] > 0]
    pairs = [
        (_name(fit.free[a]), _name(fit.free[b]), float(fit.covariance[a, b] / (std[a] * std[b])))
        for a, b in combinations(kept, 2)
    ]
    return sorted((pair for pair in pairs if abs(pair[2]) > CLOSE), key=lambda pair: -abs(pair[2]))


def _determined(fit: Fit) -> list[Key]:
    return [key for key in fit.free if key not in fit.undetermined]


def _value(fit: Fit, key: Key) -> float:
    return float(fit.model.effects[key[0]][key[1]])


def _std(fit: Fit, key: Key, inflation: float) -> float:
    return float(fit.std[key]) * sqrt(inflation)


def _name(key: Key) -> str:
    return f"{key[1]} of {key[0]}"


def _names(keys: list[Key] | tuple[Key, ...]) -> str:
    return ", ".join(_name(key) for key in keys)
