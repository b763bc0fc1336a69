"""What should an engineer know of a fit? How it ended, what it could not determine, what it could not tell apart."""

from collections.abc import Iterator
from itertools import combinations
from math import sqrt

import numpy as np

from core.fitting.descent import Outcome
from core.fitting.fit import Fit
from core.fitting.projected_misfit import parameter
from core.model.isolator import Key
from core.rounding import plain
from service.reports.units import shown, unit

CLOSE = 0.95
"""Correlation from which on two values can hardly be told apart."""
VAGUE = 0.5
"""Standard deviation over value, from which on a value is hardly known."""
TOLD = 3
"""Pairs at most."""


def words(fit: Fit, inflation: float) -> tuple[str, ...]:
    """Sentences, the most important first.

    Args:
        fit: of a model.
        inflation: of its variances, see service.models.workbench.refit.Refit.
    """
    return tuple(_sentences(fit, inflation))


def _sentences(fit: Fit, inflation: float) -> Iterator[str]:
    yield f"{OPENINGS[fit.outcome]}{fit.outcome.value}."
    if ends := list(_ends(fit)):
        yield f"At the end of its range: {'; '.join(ends)}. The effect may not be there, or another is missing."
    if fit.undetermined:
        yield (
            f"Not determined: {_names(fit.undetermined)}. The other values can do all that it does, or no record made "
            "it act; its value is only a start. Records of larger motion or of other conditions would do, or the model "
            "without it."
        )
    if vague := [key for key in _determined(fit) if _std(fit, key, inflation) > VAGUE * abs(_value(fit, key))]:
        yield f"Hardly known, by half of its value or worse: {_names(vague)}."
    if close := _close(fit):
        pairs = "; ".join(f"{one} and {other} ({ρ:+.3f})" for one, other, ρ in close[:TOLD])
        yield f"Hardly to be told apart, by their correlation: {pairs}."


OPENINGS = {
    Outcome.SETTLED: "Fitted: ",
    Outcome.AT_BOUND: "Fitted, but ",
    Outcome.UNDETERMINED: "Fitted in part: ",
    Outcome.STOPPED: "Not fitted: ",
    Outcome.DIVERGED: "Not fitted: ",
}


def _ends(fit: Fit) -> Iterator[str]:
    for key in _determined(fit):
        about, value = parameter(key), _value(fit, key)
        if value in about.bounds:
            side = "smallest" if value == about.bounds[0] else "largest"
            yield (
                f"{_name(key)}, {plain(shown(value, about.unit), 3)} {unit(about.unit)}".rstrip()
                + f", the {side} that it may be"
            )


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
