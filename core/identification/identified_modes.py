"""Fixed-base modes of a superstructure, identified from its recorded motion (paper, section 4).

A mode is reported if its pole is stable in the stabilisation diagram and the record supports it: a stable pole may
still describe a pattern in the noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy
from scipy import linalg

from core.arrays import ComplexVector, Matrix, Vector
from core.errors import IdentificationError
from core.identification.modal_uncertainty import ModalDeviation, modal_deviations
from core.identification.projection import Projection, project
from core.identification.stabilisation import (
    DiagramPole,
    StabilityCriteria,
    even_orders,
    stabilisation_diagram,
    stable_modes,
)
from core.identification.subspace import Weighting, cva, extended_observability

SIGNIFICANT = 4.0
"""Ratio of a damping ratio to its standard deviation from which a mode is significant.

Poles identified from white noise reach about three."""
LEAST_INCREASE = 0.1
"""Relative increase of the mean square misfit without a mode from which the mode counts although its damping ratio is
poorly determined. Noise alone does not reach it."""
ROUNDING = 1e-24
"""Ratio of rounding errors to an output's sum of squares. A choice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """Settings of the subspace identification."""

    rate: float = 100 / 3
    """Hz, to which the record is decimated. The modes that matter are below a third of it."""
    block_rows: int = 30
    """Block rows of the past, and of the future."""
    largest_order: int = 24
    """Highest model order in the stabilisation diagram."""
    weighting: Weighting = cva
    stability: StabilityCriteria = field(default_factory=StabilityCriteria)


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedMode:
    """An identified mode, its shape given at the sensors."""

    frequency: float
    """Hz, undamped natural frequency."""
    damping_ratio: float
    shape: ComplexVector
    """(measured,) mode shape relative to the base slab, of arbitrary length and phase."""
    deviation: ModalDeviation | None
    """Standard deviations; None if the record does not determine them."""
    shape_covariance: Matrix | None = None
    """(measured, measured) covariance of the real shape that is 1 at the highest measured floor; None if unknown."""


def identified_modes(
    base_acceleration: Vector, floor_acceleration: Matrix, rate: float, identification: Identification
) -> tuple[IdentifiedMode, ...]:
    """Modes of the floors above the base slab, with the slab's acceleration as the input.

    Args:
        base_acceleration: (n,) m/s², absolute.
        floor_acceleration: (measured, n) m/s², absolute.
        rate: Hz.
        identification: the settings.

    Returns:
        At least one mode, lowest frequency first.

    Raises:
        IdentificationError: the record is too short or at rest, or it supports no mode.
    """
    series = np.vstack([base_acceleration, floor_acceleration])
    scale = np.std(series, axis=1, keepdims=True)
    if not np.all(scale > 0):
        raise IdentificationError("a channel does not move; use a record with motion in every channel")
    factor = max(1, round(rate / identification.rate))
    # All channels pass the same anti-alias filter, which therefore does not change the modes.
    scaled = scipy.signal.resample_poly(series / scale, 1, factor, axis=1)
    projection = project(scaled[:1], scaled[1:], identification.block_rows)
    observability = extended_observability(projection, identification.weighting)
    orders = even_orders(identification.largest_order)
    diagram = stabilisation_diagram(observability, orders, rate / factor, identification.stability)
    stable = stable_modes(diagram, identification.stability)
    if not stable:
        raise IdentificationError(
            f"no pole is stable over the orders up to {orders[-1]}; use a longer or stronger record"
        )
    deviations = modal_deviations(stable, observability, orders[-1], rate / factor)
    # Each channel was divided by its scale; this restores the shapes to the record's units.
    modes = tuple(
        IdentifiedMode(mode.frequency, mode.damping_ratio, mode.shape * scale[1:, 0], deviation)
        for mode, deviation in _supported(stable, deviations, projection)
    )
    if not modes:
        raise IdentificationError(
            f"{len(stable)} poles are stable, but noise explains them all; use a longer or stronger record"
        )
    return modes


def _supported(
    modes: Sequence[DiagramPole], deviations: Sequence[ModalDeviation | None], projection: Projection
) -> list[tuple[DiagramPole, ModalDeviation | None]]:
    """The modes that the record supports, each with its standard deviations."""
    eigenvalues = np.array([mode.eigenvalue for mode in modes])
    increase = misfit_increase(eigenvalues, projection.inputs, projection.outputs).max(axis=1)
    return [
        (mode, deviation)
        for mode, deviation, without in zip(modes, deviations, increase, strict=True)
        if is_supported(mode.damping_ratio, deviation, float(without))
    ]


def is_supported(damping_ratio: float, deviation: ModalDeviation | None, increase: float) -> bool:
    """True if a mode belongs to the structure: its damping is significant, or the record needs it.

    Args:
        damping_ratio: of the mode.
        deviation: its standard deviations, if known.
        increase: relative increase of the misfit without the mode, the largest of all outputs.
    """
    is_significant = deviation is not None and damping_ratio >= SIGNIFICANT * deviation.damping_ratio
    return is_significant or increase >= LEAST_INCREASE


def misfit_increase(eigenvalues: ComplexVector, inputs: Matrix, outputs: Matrix) -> Matrix:
    """Relative increase of each output's mean square misfit when one mode is left out.

    Every output is fitted by least squares with the inputs and with the modes' responses to the inputs and to an
    impulse at the start.

    Args:
        eigenvalues: (modes,) of decaying modes, one of each conjugate pair.
        inputs: (m, n).
        outputs: (p, n).

    Returns:
        (modes, outputs) misfit without the mode over the misfit with all modes, minus one.
    """
    impulse = np.eye(1, inputs.shape[1])
    forced = [scipy.signal.lfilter([0, 1], [1, -w], np.vstack([inputs, impulse]), axis=1) for w in eigenvalues]
    responses = np.concatenate([part for mode in forced for part in (mode.real, mode.imag)])
    regressors = np.vstack([responses, inputs])
    # One QR factorisation of regressors and outputs removes time from the fits that follow.
    triangle = linalg.qr(np.vstack([regressors, outputs]).T, mode="raw", check_finite=False)[1]
    R, Y = np.split(triangle, [len(regressors)], axis=1)
    width = len(responses) // len(eigenvalues)
    every = _misfit(R, Y)
    without = [_misfit(np.delete(R, np.s_[i * width : (i + 1) * width], axis=1), Y) for i in range(len(eigenvalues))]
    # Rounding errors of an output that the inputs explain exactly are not a misfit.
    rounding = ROUNDING * np.sum(outputs**2, axis=1)
    return np.asarray((np.array(without) - every) / (every + rounding))


def _misfit(regressors: Matrix, outputs: Matrix) -> Vector:
    """(outputs,) residual sum of squares."""
    residual = outputs - regressors @ linalg.lstsq(regressors, outputs, check_finite=False)[0]
    return np.asarray(np.sum(residual**2, axis=0))
