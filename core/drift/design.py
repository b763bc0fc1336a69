"""Which columns does the expected value consist of, and what is believed of their coefficients beforehand?

A cubic spline over the logarithm of the amplitude with equidistant knots and a penalty on the second differences of its
coefficients (P-spline; Eilers and Marx, 1996), which is a Gaussian prior (Lang and Brezger, 2004): where no data are,
the curve goes on straight, and its variance grows. One column for the temperature, or, where nothing measured it, the
two of a yearly wave.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.linalg import block_diag

from core.arrays import Matrix, Vector
from core.drift.points import Points
from core.drift.watched import Quantity

SPACING = 0.5
"""Of the knots, in the natural logarithm of amplitude: a yielding layer's stiffness bends over one to two."""
BEYOND = 2.5
"""Natural logarithm of amplitude by which the knots reach beyond the data, a factor of twelve; what lies farther is
taken to be there."""
DEGREE = 3
LEVEL = 3.0
"""Standard deviation of a coefficient about the reference's median, so that level and slope are hardly bound."""
SWING = 10.0
"""K, standard deviation of a layer's temperature over the year, where nothing measured it."""
MEASURED = 0.8
"""Share of the reference's observations with a temperature from which on its influence is found from them."""


@dataclass(frozen=True, slots=True, eq=False)
class Design:
    """Columns and their prior."""

    quantity: Quantity
    level: float
    """Median of the reference's values: logarithm, or SI units."""
    size: float
    """What a change of one is in the unit of the value: 1 of a logarithm, else what is typical of the scatter."""
    low: float
    high: float
    """Natural logarithm of the amplitudes that the reference has seen."""
    temperature: float | None
    """°C, mean of the reference; None where it was not measured or has no influence."""
    swing: float
    """K, standard deviation of the temperature where it is not known."""

    @property
    def knots(self) -> Vector:
        """Equidistant, `DEGREE` more on each side than the curve needs."""
        count = int(np.ceil((self.high - self.low + 2 * BEYOND) / SPACING))
        middle = (self.low + self.high) / 2
        return np.asarray(middle + SPACING * (np.arange(count + 2 * DEGREE + 1) - (count / 2 + DEGREE)))

    @property
    def is_seasonal(self) -> bool:
        """Whether a yearly wave stands in for the temperature."""
        return self.quantity.follows_temperature and self.temperature is None

    def columns(self, points: Points) -> Matrix:
        """(n, p) of every observation."""
        parts = [self._curve(points.amplitude)]
        if self.temperature is not None:
            parts.append(np.nan_to_num(points.temperature - self.temperature)[:, None])
        if self.is_seasonal:
            parts.append(np.column_stack([np.cos(points.season), np.sin(points.season)]))
        return np.hstack(parts)

    def offset(self, points: Points) -> Vector:
        """(n,) what is expected with all coefficients zero: the level, and the usual influence of the temperature."""
        if self.temperature is None:
            return np.full(points.value.size, self.level)
        usual, _ = self.quantity.per_kelvin
        return self.level + usual * np.nan_to_num(points.temperature - self.temperature)

    def unknown_temperature(self, points: Points) -> Vector:
        """(n,) K², variance of what an observation's temperature may have been besides."""
        if self.temperature is None:
            return np.zeros(points.value.size)
        return np.where(np.isnan(points.temperature), self.swing**2, 0.0)

    def precision(self, bend: float) -> Matrix:
        """(p, p) of the coefficients beforehand.

        Args:
            bend: standard deviation of the second difference of the curve's coefficients.
        """
        if not self.quantity.follows_amplitude:
            curve = np.eye(1) / (LEVEL * self.size) ** 2
        else:
            size = self.knots.size - DEGREE - 1
            bends = np.diff(np.eye(size), 2, axis=0)
            curve = bends.T @ bends / bend**2 + np.eye(size) / LEVEL**2
        usual, among = self.quantity.per_kelvin
        if self.temperature is not None:
            return np.asarray(block_diag(curve, among**-2))
        if self.is_seasonal:
            return np.asarray(block_diag(curve, np.eye(2) / (np.hypot(usual, among) * SWING) ** 2))
        return curve

    def _curve(self, amplitude: Vector) -> Matrix:
        if not self.quantity.follows_amplitude:
            return np.ones((amplitude.size, 1))
        knots = self.knots
        within = np.clip(amplitude, knots[DEGREE], knots[-DEGREE - 1])
        return np.asarray(BSpline.design_matrix(within, knots, DEGREE).toarray())


def design(known: Quantity, reference: Points) -> Design:
    """The design that a reference of at least one observation asks for."""
    measured = reference.temperature[~np.isnan(reference.temperature)]
    is_measured = known.follows_temperature and measured.size >= MEASURED * reference.value.size
    return Design(
        quantity=known,
        level=float(np.median(reference.value)),
        size=1.0 if known.is_logarithmic else 100 * known.scatter,
        low=float(reference.amplitude.min()),
        high=float(reference.amplitude.max()),
        temperature=float(measured.mean()) if is_measured else None,
        swing=max(SWING, float(measured.std())) if is_measured else SWING,
    )
