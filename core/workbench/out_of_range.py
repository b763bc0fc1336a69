"""Held-out earthquakes in which a model fails although it fits the others, and what they have beyond the others."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from core.arrays import Mask, Vector
from core.comparison.compared import ForceComparison
from core.comparison.covariates import half_cycle_amplitude
from core.fitting.observation import Observation
from core.rounding import plain
from core.units import percent, shown, unit
from core.workbench.earthquakes import Earthquakes, ModelErrors

FITS = 1.5
"""Largest noise ratio where a model was fitted with which it fits: that of a model which cannot tell noise of another
spectrum from an error. A choice."""
FAILS = 2.0
"""Noise ratio on a held-out earthquake, over that where the model was fitted, from which on the model fails there,"""
FELT = 0.03
"""and error beyond the noise over the force there. Choices."""
BEYOND: Mapping[str, float] = MappingProxyType({"displacement": 1.1, "velocity": 1.1})
"""Largest value in a held-out earthquake over that in the fitted ones, from which on it is out of range. A choice."""
WARMER = 2.0
"""°C, the same for temperatures. A choice."""
UNITS: Mapping[str, str] = MappingProxyType({"displacement": "m", "velocity": "m/s", "temperature": "°C"})


@dataclass(frozen=True, slots=True)
class Exceeded:
    """A quantity that a held-out earthquake has beyond the range of the fitted ones."""

    quantity: str
    """One of UNITS."""
    limit: float
    """SI units or °C, the end of the fitted range."""
    reached: float
    """The largest value in the earthquake, or its temperature."""
    share: float
    """Share of the squared error that lies beyond the limit."""


@dataclass(frozen=True, slots=True)
class OutOfRange:
    """A held-out earthquake in which a model fails, in one direction."""

    name: str
    """Name of the earthquake."""
    direction: str
    noise_ratio: float
    """Error over the error that noise alone makes."""
    noise_ratio_fitted: float
    """The same where the model was fitted, in this direction."""
    nrmse: float
    """Error over the force there."""
    exceeded: tuple[Exceeded, ...]
    """Quantities beyond the fitted range, that with most of the error first; none if all are within it."""


def out_of_range(errors: ModelErrors, earthquakes: Earthquakes) -> tuple[OutOfRange, ...]:
    """Failures on held-out earthquakes, the largest first; none of a model that does not fit where it was fitted.

    Args:
        errors: of the model in all earthquakes.
        earthquakes: those.
    """
    found = []
    for direction in earthquakes.directions:
        along = errors.along(direction)
        fitted = [one for one in along.forces if one.observation.name not in earthquakes.held_out]
        if not fitted or (ratio := along.of(earthquakes.fitted_names).noise_ratio) > FITS:
            continue
        seen = [one.observation for one in fitted]
        found += [
            _failure(one, ratio, seen)
            for one in along.forces
            if one.observation.name in earthquakes.held_out and _fails(one, ratio)
        ]
    return tuple(sorted(found, key=lambda one: -one.noise_ratio))


def _fails(one: ForceComparison, fitted: float) -> bool:
    misfit = one.misfit
    felt = misfit.nrmse * misfit.excess / misfit.rms if misfit.rms > 0 else 0.0
    return misfit.noise_ratio > FAILS * max(fitted, 1.0) and felt > FELT


def _failure(one: ForceComparison, fitted: float, seen: Sequence[Observation]) -> OutOfRange:
    exceeded = sorted(_exceeded(one, seen), key=lambda part: -part.share)
    observation, misfit = one.observation, one.misfit
    return OutOfRange(
        observation.name, observation.direction, misfit.noise_ratio, fitted, misfit.nrmse, tuple(exceeded)
    )


def _exceeded(one: ForceComparison, seen: Sequence[Observation]) -> Iterator[Exceeded]:
    layer = one.observation.layer
    histories = {
        "displacement": (half_cycle_amplitude(layer.displacement), [np.abs(at.layer.displacement) for at in seen]),
        "velocity": (np.abs(layer.velocity), [np.abs(at.layer.velocity) for at in seen]),
    }
    for name, (values, others) in histories.items():
        limit = max(float(other.max()) for other in others)
        if (reached := float(values.max())) > BEYOND[name] * limit:
            yield Exceeded(name, limit, reached, _share(one, values > limit))
    here = float(np.mean(one.observation.conditions.temperature))
    there = [float(np.mean(at.conditions.temperature)) for at in seen]
    low, high = min(there), max(there)
    if here > high + WARMER or here < low - WARMER:
        yield Exceeded("temperature", high if here > high else low, here, 1.0)


def _share(one: ForceComparison, where: Mask) -> float:
    squared: Vector = one.residual**2
    return float(squared[where].sum() / squared.sum())


def range_sentences(found: Sequence[OutOfRange]) -> Iterator[str]:
    """Sentences on the failures: where, beyond what, and what to do."""
    for one in found:
        yield (
            f"In the held-out earthquake {one.name}, direction {one.direction}, the model fails: its error is "
            f"{percent(one.nrmse)} of the force and {plain(one.noise_ratio, 3)} times the noise, "
            f"{plain(one.noise_ratio_fitted, 3)} times where it was fitted."
        )
        for part in one.exceeded:
            si = UNITS[part.quantity]
            limit, reached = (f"{plain(shown(value, si), 3)} {unit(si)}" for value in (part.limit, part.reached))
            if part.quantity == "temperature":
                yield f"Its temperature, {reached}, is beyond that of the fitted earthquakes, {limit}."
                continue
            yield (
                f"Its largest {part.quantity}, {reached}, is beyond that of the fitted earthquakes, {limit}; "
                f"{percent(part.share)} of the squared error lies there."
            )
        if not one.exceeded:
            yield (
                "Its displacement, velocity and temperature are within the range of the fitted earthquakes: something "
                "else changed between them."
            )
    if found:
        yield "Fit with these records: only then can a diagnosis show whether an effect is missing."
