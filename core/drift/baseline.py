"""Which value is expected at an amplitude and a temperature, and how surely?

A linear mixed model: columns of `core.drift.design`, one common error for each event, one for each observation; by
generalised least squares with the coefficients' prior, robust by Huber's weights (1964) on observations and on events.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from core.arrays import Matrix, Vector
from core.drift.design import Design, design
from core.drift.points import Points
from core.drift.scatter import BENDS, Scatter, normal_equations, scatter, sums
from core.drift.watched import Quantity

FEWEST = 20
"""Events of a reference: with fewer their scatter is not known."""
DETERMINED = 0.5
"""Of the scatter of events: what the baseline may add to an event's standard deviation when it counts as determined."""
HUBER = 2.0
"""Standard deviations beyond which an observation, or an event, counts for less."""
ROUNDS = 3


@dataclass(frozen=True, slots=True, eq=False)
class Baseline:
    """What a healthy building is expected to do."""

    events: tuple[int, ...]
    """Of the reference."""
    design: Design
    coefficients: Vector
    """(p,)"""
    covariance: Matrix
    """(p, p)"""
    scatter: Scatter
    wanted: int
    """Events that the reference lacks until the curve is determined."""

    @property
    def range(self) -> tuple[float, float] | None:
        """Amplitudes that the reference has seen, in SI units; None if the quantity follows none."""
        if not self.design.quantity.follows_amplitude:
            return None
        return float(np.exp(self.design.low)), float(np.exp(self.design.high))

    def expected(self, amplitude: Vector, temperature: float | None = None) -> tuple[Vector, Vector]:
        """The expected value and the standard deviation of an event's value about it, without its own measurement.

        Args:
            amplitude: (n,) SI units.
            temperature: °C; None: the mean of the reference, or of the year.

        Returns:
            (n,) natural logarithm of SI units where the quantity's logarithm is watched, else SI units; and (n,) the
            standard deviation, of the curve and of the scatter from event to event.
        """
        count = amplitude.size
        middle = np.nan if self.design.temperature is None else self.design.temperature
        nothing = np.zeros(count)
        places = Points(
            event=np.arange(count),
            time=nothing,
            value=nothing,
            variance=nothing,
            amplitude=np.log(amplitude) if self.design.quantity.follows_amplitude else nothing,
            temperature=np.full(count, middle if temperature is None else temperature),
        )
        columns = self.design.columns(places)
        if self.design.is_seasonal:
            columns[:, -2:] = 0.0
        variance = np.einsum("ij,jk,ik->i", columns, self.covariance, columns) + self.scatter.events**2
        return self.design.offset(places) + columns @ self.coefficients, np.sqrt(variance)


def fitted(known: Quantity, reference: Points, events: tuple[int, ...]) -> Baseline:
    """The baseline of a reference.

    Args:
        known: which quantity it is.
        reference: observations; their `event` is the index into `events`, and each has one at least.
        events: of the reference.
    """
    chosen = design(known, reference)
    columns = chosen.columns(reference)
    value = reference.value - chosen.offset(reference)
    precisions = np.array([chosen.precision(bend) for bend in BENDS])
    trust, doubt = np.ones(value.size), np.ones(len(events))
    for _ in range(ROUNDS):
        spread = scatter(columns, value, reference.variance, trust, reference.event, doubt, precisions, known)
        weight = trust / (reference.variance + spread.own**2)
        found = sums(columns, value, weight, reference.event, len(events))
        information, product = normal_equations(found, spread.events**2 * doubt)
        factor = cho_factor(information + chosen.precision(spread.bend))
        coefficients = cho_solve(factor, product)
        residual = value - columns @ coefficients
        common = np.bincount(reference.event, weight * residual, len(events)) / found.weight
        doubt = _excess(common / np.sqrt(spread.events**2 + 1 / found.weight))
        trust = 1 / _excess((residual - common[reference.event]) / np.sqrt(reference.variance + spread.own**2))
    covariance = np.asarray(cho_solve(factor, np.eye(product.size)))
    of_events = found.of_events / found.weight[:, None]
    error = float(np.mean(np.einsum("ij,jk,ik->i", of_events, covariance, of_events)))
    # The variance of a curve falls with the number of events that it is drawn through.
    enough = len(events) * error / (DETERMINED * spread.events) ** 2
    wanted = max(0, FEWEST - len(events), int(np.ceil(enough - 1e-9)) - len(events))
    return Baseline(events, chosen, np.asarray(coefficients), covariance, spread, wanted)


def _excess(deviation: Vector) -> Vector:
    """Standard deviations over those that count in full, at least 1."""
    return np.maximum(1.0, np.abs(deviation) / HUBER)
