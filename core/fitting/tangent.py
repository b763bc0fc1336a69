"""Tangent stiffness and damping of a layer along a record, from the record alone.

An error e of the displacement changes the force of the layer's law by its tangent stiffness times e. Small cycles of a
layer that yields are far stiffer than its loop, so that no single slope is right for them. The force is therefore
regressed, with coefficients of at least 0, on elements whose tangent is known at every sample: springs that slip
(Iwan 1966; the stops of Prandtl and Ishlinskii), springs behind a gap, and dashpots that saturate. Most laws of a layer
are near such a sum, and it needs no model, so that the noise is the same for all models that are compared.

A spring that slips forgets the error from before its last slip: since then, τ ago, it has felt e(t) − e(t − τ). That
holds all of an error that is fast against τ, and next to nothing of a slow one. It counts as a high-pass of the first
order with the time constant τ. Laws with slip are driven by the velocity: they err only where that does.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.optimize import nnls

from core.arrays import ComplexVector, Matrix, Vector
from core.code_generation.compilation import bound, cached
from core.fitting.observation import LayerHistory
from core.signals.whitening import Whitening

SLIPS = 14
"""Springs that slip, their lengths evenly spaced in the logarithm. A choice."""
SHORTEST, LONGEST = 1e-3, 0.5
"""Their lengths, as shares of the largest displacement. A choice."""
CLEAR = 4.0
"""Standard deviations of the displacement's error that the shortest of them is long at least. A choice."""
GAPS = (0.3, 0.5, 0.7, 0.85)
"""Displacements at which springs behind a gap begin to act, as shares of the largest. A choice."""
SATURATING = (0.01, 0.03, 0.1, 0.3)
"""Velocities at which dashpots saturate, as shares of the largest. A choice."""
FREQUENCIES = np.geomspace(0.05, 20.0, 16)
"""Hz, at which the stiffness is computed; on straight lines between them. A choice."""
MOST_ITERATIONS = 1000
"""Largest number of iterations of the regression, which needs about one for each element."""


@dataclass(frozen=True, slots=True, eq=False)
class Tangent:
    """Tangent stiffness and damping of a layer at every sample."""

    lasting: Vector
    """(n,) N/m, stiffness of the elements that remember any error."""
    slipping: Matrix
    """(springs, n) N/m, stiffness of those that slip; 0 where they do, and where the velocity counts as exact."""
    since: Matrix
    """(springs, n) s since the last slip of each."""
    damping: Vector
    """(n,) N s/m; 0 where the velocity counts as exact."""

    @property
    def stiffness(self) -> Vector:
        """(n,) N/m, against an error that is fast."""
        return np.asarray(self.lasting + self.slipping.sum(axis=0))

    def mean_square(self, window: Vector) -> Callable[[Vector], Vector]:
        """(N/m)² at (k,) frequencies in Hz: power of the force's error over that of the displacement's.

        The velocity's error is the derivative of the displacement's.

        Args:
            window: (n,) by which every history is multiplied.
        """
        share = window**2 / np.sum(window**2)
        squares = np.array([share @ np.abs(self._at(2 * np.pi * one)) ** 2 for one in FREQUENCIES])
        return lambda frequency: np.asarray(np.interp(frequency, FREQUENCIES, squares))

    def _at(self, ω: float) -> ComplexVector:
        """(n,) N/m, complex, at an angular frequency in rad/s."""
        along = 1j * ω * self.since
        felt: ComplexVector = np.sum(self.slipping * along / (1 + along), axis=0)
        return self.lasting + felt + 1j * ω * self.damping


def tangent(layer: LayerHistory, rate: float, weights: Whitening) -> Tangent:
    """Tangent of the sum of elements that is nearest to the force.

    Args:
        layer: moves.
        rate: Hz.
        weights: by the error of the force.
    """
    u, v = layer.displacement, layer.velocity
    far, fast = float(np.abs(u).max()), float(np.abs(v).max())
    std = 0.0 if layer.displacement_std is None else float(np.median(layer.displacement_std))
    slips = [slip(u, length) for length in _lengths(far, CLEAR * std)]
    gaps = [one * far for one in GAPS]
    limits = [one * fast for one in SATURATING]
    forces = [u, v, *(z for z, _ in slips), *(u - np.clip(u, -one, one) for one in gaps)]
    forces += [np.clip(v, -one, one) for one in limits]
    spring, dashpot, *others = _coefficients(np.array(forces), layer.force, weights)
    by_slip, by_gap, by_limit = np.split(np.array(others), [len(slips), len(slips) + len(gaps)])
    moving = 0.0 if layer.velocity_std is None else 1.0
    since = np.array([ago for _, ago in slips]).reshape(-1, u.size) / rate
    return Tangent(
        lasting=spring + by_gap @ np.array([np.abs(u) > one for one in gaps]),
        slipping=moving * by_slip[:, None] * (since > 0),
        since=since,
        damping=moving * (dashpot + by_limit @ np.array([np.abs(v) < one for one in limits])),
    )


def _lengths(far: float, least: float) -> Vector:
    """(springs,) m, lengths of the springs; none where the motion is little larger than its error."""
    shortest, longest = max(SHORTEST * far, least), LONGEST * far
    return np.geomspace(shortest, longest, SLIPS) if shortest < longest else np.zeros(0)


def _coefficients(forces: Matrix, force: Vector, weights: Whitening) -> Vector:
    """(elements,) of the sum of forces that is nearest to the force, each at least 0."""
    columns = weights.whitened(weights.filtered(forces))
    size = np.linalg.norm(columns, axis=1)
    size[size == 0] = 1.0
    found, _ = nnls((columns / size[:, None]).T, weights.of(force[None])[0], maxiter=MOST_ITERATIONS)
    return np.asarray(found / size)


def slip(displacement: Vector, length: float) -> tuple[Vector, Vector]:
    """Deflection of a spring that slips, and how long ago it last did.

    Args:
        displacement: (n,) m.
        length: m, deflection at which it slips.

    Returns:
        (n,) m and (n,) samples; 0 samples while it slips. It begins undeflected, as after a slip.
    """
    deflection, since = _compiled_slip()(displacement, length)
    return deflection, since


@cache
def _compiled_slip() -> Callable[[Vector, float], tuple[Vector, Vector]]:
    compiled: Callable[[Vector, float], tuple[Vector, Vector]] = cached(bound(_slip), "")
    return compiled


def _slip(u, length):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Kernel of `slip`; Numba finds the types."""
    deflection, since = np.zeros(u.size), np.zeros(u.size)
    for i in range(1, u.size):
        free = deflection[i - 1] + (u[i] - u[i - 1])
        deflection[i] = min(length, max(-length, free))
        if free == deflection[i]:
            since[i] = since[i - 1] + 1
    return deflection, since
