"""Is the mass wrong that forces were estimated with, rather than the isolation layer unlike its design?

A force is mass times acceleration: with a total mass told too large by some share every force is, and so are the
stiffness, the damping and the yield force that a model finds in the records, while its yield displacement stays. That
hypothesis is held against values that are as designed and against values that differ each by itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.fitting.fit import Fit
from core.model.isolator import Isolator, Key

DESIGN = 0.04
"""Of the logarithm of each design value: standard deviation about what was built."""
COMMON = 0.15
"""Of the logarithm of the factor that a wrong mass makes."""
OFF = 0.2
"""Of the logarithm of a design value that is wrong by itself."""
DECISIVE = 2.5
"""Of log evidence, by which a wrong mass must explain more than the design's usual scatter does."""
FEWEST = 2
"""Values that a mass scales, without which nothing tells it from one wrong value."""


@dataclass(frozen=True, slots=True)
class WrongMass:
    """The factor that all forces have in common."""

    change: float
    """Of the mass as told against what the design of the layer asks for, relative."""
    std: float


def wrong_mass(fit: Fit, design: Isolator, given: Mapping[str, float | None]) -> WrongMass | None:
    """By how much the told mass is off, None unless that is what explains the values best.

    A model that lacks an effect finds other values than the design's for that reason: the fit should leave nothing.

    Args:
        fit: of a model of stiffness, damping and, perhaps, Bouc-Wen hysteresis.
        design: the same with the building's design values.
        given: names of the design's values, None for those that nobody gave.
    """
    names = [name for name in ("k_b", "c_b", "F_y", "D_y") if given.get(name) is not None]
    here, change = _logarithms(fit.model, fit.free)
    there, _ = _logarithms(design, fit.free)
    kept = [name for name in names if name in here and name in there]
    forces = np.array([name != "D_y" for name in kept])
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
    """Of stiffness, damping, yield force and yield displacement, and (free,) their derivatives by fitted values.

    The hysteretic variable ends at z = (A / (β + γ))^(1/n), so that the force is F_y z and the displacement D_y z / A.
    """
    effects = model.effects
    values, slopes = dict[str, float](), dict[str, Vector]()

    def add(name: str, value: float, by: Mapping[Key, float]) -> None:
        values[name], slopes[name] = value, np.array([by.get(key, 0.0) for key in free])

    of = {parameter: effect for effect, held in effects.items() for parameter in held}
    for name in ("k_b", "c_b"):
        if name in of and effects[of[name]][name] > 0:
            add(name, float(np.log(effects[of[name]][name])), {(of[name], name): 1 / effects[of[name]][name]})
    if "F_y" in of and effects[of["F_y"]]["F_y"] > 0:
        law, yielding = of["F_y"], effects[of["F_y"]]
        softening = yielding["beta"] + yielding["gamma"]
        end = float(np.log(yielding["A"] / softening)) / yielding["n"]
        by_beta = {(law, "beta"): -1 / (softening * yielding["n"])}
        add("F_y", float(np.log(yielding["F_y"])) + end, {(law, "F_y"): 1 / yielding["F_y"], **by_beta})
        far = float(np.log(yielding["D_y"] / yielding["A"])) + end
        add("D_y", far, {(law, "D_y"): 1 / yielding["D_y"], **by_beta})
    return values, slopes


def _evidence(deviation: Vector, covariance: Matrix) -> float:
    """Log probability density of the deviation."""
    return -0.5 * float(deviation @ np.linalg.solve(covariance, deviation)) - 0.5 * float(
        np.linalg.slogdet(covariance)[1]
    )


def _common(deviation: Vector, covariance: Matrix, forces: Vector) -> tuple[float, float]:
    """The factor's logarithm by least squares, and its standard deviation."""
    weighted = np.linalg.solve(covariance, forces.astype(float))
    variance = 1 / float(weighted @ forces)
    return variance * float(weighted @ deviation), float(np.sqrt(variance))
