"""Misfit of a model: sums over samples from which every measure of its error follows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, sqrt

import numpy as np

from core.arrays import Vector


@dataclass(frozen=True, slots=True)
class Misfit:
    """Misfit of one quantity, in its own unit, over one record or several.

    It is kept as sums over samples, from which every measure follows, so that records can be combined.
    """

    samples: int
    error: float
    """Σ (measured − model)²."""
    signal: float
    """Σ measured²."""
    spread: float
    """Σ (measured − its mean over the record)²."""
    noise: float
    """Σ of the squared error that noise alone makes: the error over the square of the noise ratio."""

    @property
    def rms(self) -> float:
        """Root mean square of the error."""
        return sqrt(self.error / self.samples)

    @property
    def floor(self) -> float:
        """Root mean square error of a correct model: that of the measurement."""
        return sqrt(self.noise / self.samples)

    @property
    def nrmse(self) -> float:
        """Root mean square error over the root mean square of what was measured."""
        return sqrt(self.error / self.signal) if self.signal > 0 else inf

    @property
    def fitting_rate(self) -> float:
        """Percent, the paper's: 100 (1 − ‖y − ŷ‖ / ‖y − mean(y)‖); see `fitting_rate`."""
        return 100 * (1 - sqrt(self.error / self.spread)) if self.spread > 0 else -inf

    @property
    def noise_ratio(self) -> float:
        """Error over the error that noise alone makes, about 1 for a correct model (both root mean squares)."""
        return sqrt(self.error / self.noise) if self.noise > 0 else inf

    @property
    def excess(self) -> float:
        """Root mean square of the error beyond the noise."""
        return sqrt(max(self.error - self.noise, 0.0) / self.samples)


def misfit(measured: Vector, model: Vector, std: Vector) -> Misfit:
    """Misfit over one record.

    Args:
        measured: (n,) any unit.
        model: (n,) of the same unit.
        std: (n,) standard deviation of what was measured, of the same unit.
    """
    return Misfit(
        samples=measured.size,
        error=float(np.sum((measured - model) ** 2)),
        signal=float(np.sum(measured**2)),
        spread=float(np.sum((measured - measured.mean()) ** 2)),
        noise=float(np.sum(std**2)),
    )


def misfit_at_ratio(measured: Vector, model: Vector, noise_ratio: float, noise: float) -> Misfit:
    """Misfit over one record whose noise ratio is known from another measure, such as part of its band.

    Args:
        measured: (n,) any unit.
        model: (n,) of the same unit.
        noise_ratio: error over the error that noise alone makes.
        noise: root mean square of the noise, of the same unit; it counts only if the noise ratio is 0.
    """
    known = misfit(measured, model, np.full(measured.size, noise))
    return replace(known, noise=known.error / noise_ratio**2) if noise_ratio > 0 else known


def pooled(misfits: Sequence[Misfit]) -> Misfit:
    """Misfit over several records as one.

    A large earthquake weighs as its motion is large. In the noise ratio each record counts by its own noise instead.
    """
    samples, error = (sum(getattr(one, name) for one in misfits) for name in ("samples", "error"))
    squared = sum(one.samples * one.noise_ratio**2 for one in misfits) / samples
    return Misfit(
        samples=samples,
        error=error,
        signal=sum(one.signal for one in misfits),
        spread=sum(one.spread for one in misfits),
        noise=error / squared if squared > 0 else sum(one.noise for one in misfits),
    )


def fitting_rate(truth: Vector, estimate: Vector) -> float:
    """The paper's fitting rate (Figures 10-12 and 16): 100 (1 - ‖y - ŷ‖ / ‖y - mean(y)‖) over the whole record.

    Args:
        truth: (n,) y, any unit; not constant.
        estimate: (n,) ŷ, of the same unit.

    Returns:
        Percent: 100 for an exact estimate, 0 for the truth's mean, negative for anything worse.
    """
    return float(100 * (1 - np.linalg.norm(truth - estimate) / np.linalg.norm(truth - truth.mean())))
