"""A wrong mass, distinguished from isolators that differ from their design.

A force is mass times acceleration: if the building file states too large a mass, all forces are too large by the same
factor, and so are the stiffness, the damping and the yield force of a fitted model. Its yield displacement is not. This
hypothesis competes with values that are as designed and with values that differ each by itself.
"""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from core.arrays import Matrix, Vector
from core.effects import EFFECTS
from core.fitting.fit import Fit
from core.model.isolator import Isolator, Key

LENGTHS = ("D_y",)
"""Design values that do not scale with the mass."""
DESIGN = 0.04
"""Standard deviation of the logarithm of a value as built about its design value."""
COMMON = 0.15
"""Standard deviation of the logarithm of the factor that a wrong mass makes."""
OFF = 0.2
"""Standard deviation of the logarithm of a design value that is wrong by itself."""
DECISIVE = 2.5
"""Smallest log evidence of a wrong mass over the design's usual scatter."""
FEWEST = 2
"""Smallest number of values that a mass scales: fewer cannot distinguish it from one wrong value."""


@dataclass(frozen=True, slots=True)
class WrongMass:
    """Common factor of all forces."""

    change: float
    """Relative difference of the stated mass from the one that agrees with the layer's design."""
    std: float


def wrong_mass(fit: Fit, design: Isolator, given: Mapping[str, float | None]) -> WrongMass | None:
    """Error of the stated mass; None unless it explains the fitted values best.

    A model that lacks an effect differs from the design for that reason: the residual of the fit should be noise.

    Args:
        fit: of a model whose effects have design values; see core.effect.Effect.design.
        design: the same model at the building's design values.
        given: the design values by name, None for those that the building file does not give.
    """
    names = [name for name, value in given.items() if value is not None]
    here, change = _logarithms(fit.model, fit.free)
    there, _ = _logarithms(design, fit.free)
    kept = [name for name in names if name in here and name in there]
    forces = np.array([name not in LENGTHS for name in kept])
    if forces.sum() < FEWEST:
        return None
    deviation = np.array([here[name] - there[name] for name in kept])
    rows = np.array([change[name] for name in kept])
    noise = rows @ fit.covariance @ rows.T
    designed = noise + DESIGN**2 * np.eye(len(kept))
    common = designed + COMMON**2 * np.outer(forces, forces)
    mass = _evidence(deviation, common)
    apart = _evidence(deviation, noise + OFF**2 * np.eye(len(kept)))
    if mass < max(apart, DECISIVE + _evidence(deviation, designed)):
        return None
    factor, std = _common(deviation, designed, forces)
    return WrongMass(float(np.expm1(factor)), float(np.exp(factor)) * std)


def _logarithms(model: Isolator, free: tuple[Key, ...]) -> tuple[dict[str, float], dict[str, Vector]]:
    """Logarithms of the model's positive design values, and their (free,) derivatives by fitted parameters."""
    values, slopes = dict[str, float](), dict[str, Vector]()
    for effect, parameters in model.effects.items():
        for name, value_of in EFFECTS[effect].design.items():
            own = {key: parameters[key] for key in inspect.signature(value_of).parameters}
            if (value := value_of(**own)) > 0:
                by = {(effect, key): _derivative(value_of, own, key) / value for key in own}
                values[name], slopes[name] = float(np.log(value)), np.array([by.get(key, 0.0) for key in free])
    return values, slopes


def _derivative(value_of: Callable[..., Any], parameters: Mapping[str, float], key: str) -> float:
    """Exact to rounding, by a step into the complex plane (Squire and Trapp 1998)."""
    step = 1e-20 * parameters[key]
    return float(value_of(**{**parameters, key: parameters[key] + 1j * step}).imag / step) if step else 0.0


def _evidence(deviation: Vector, covariance: Matrix) -> float:
    """Log probability density of the deviation."""
    return -0.5 * float(deviation @ np.linalg.solve(covariance, deviation)) - 0.5 * float(
        np.linalg.slogdet(covariance)[1]
    )


def _common(deviation: Vector, covariance: Matrix, forces: Vector) -> tuple[float, float]:
    """Logarithm of the factor by least squares, and its standard deviation."""
    weighted = np.linalg.solve(covariance, forces.astype(float))
    variance = 1 / float(weighted @ forces)
    return variance * float(weighted @ deviation), float(np.sqrt(variance))
