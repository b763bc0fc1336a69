"""The fixed-base modes of a superstructure from its recorded motion: the whole of the paper's section 4."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import signal

from core.arrays import ComplexVector, Matrix, Vector
from core.errors import IdentificationError
from core.identification.modal_uncertainty import ModalDeviation, modal_deviations
from core.identification.mode_support import is_supported, misfit_growth
from core.identification.projection import Projection, project
from core.identification.stabilisation import DiagramPole, Stability, even_orders, stabilisation_diagram, stable_modes
from core.identification.subspace import Weighting, cva, observability_span


@dataclass(frozen=True, slots=True, kw_only=True)
class Identification:
    """What an engineer may choose about the identification."""

    rate: float = 100 / 3
    """Hz, to which the record is decimated: the modes that matter are below a third of it."""
    block_rows: int = 30
    largest_order: int = 24
    weighting: Weighting = cva
    stability: Stability = field(default_factory=Stability)


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedMode:
    """One mode, at the sensors."""

    frequency: float
    """Hz, undamped."""
    damping_ratio: float
    shape: ComplexVector
    """(measured,) relative to the base slab, of any length and phase."""
    deviation: ModalDeviation | None
    shape_covariance: Matrix | None = None
    """(measured, measured) of the real shape, 1 at the highest measured floor; None where it is not known."""


def identified_modes(
    base_acceleration: Vector, floor_acceleration: Matrix, rate: float, identification: Identification
) -> tuple[IdentifiedMode, ...]:
    """Modes of the floors above the base slab, the slab's acceleration being the input.

    Args:
        base_acceleration: (n,) m/s², absolute.
        floor_acceleration: (measured, n) m/s², absolute.
        rate: Hz.
        identification: the choices.

    Returns:
        At least one, lowest frequency first.

    Raises:
        IdentificationError: the record is too short or at rest, or it supports no mode.
    """
    series = np.vstack([base_acceleration, floor_acceleration])
    scale = np.std(series, axis=1, keepdims=True)
    if not np.all(scale > 0):
        raise IdentificationError("a channel does not move; a record with motion in every channel would do")
    factor = max(1, round(rate / identification.rate))
    # Every channel passes the same anti-alias filter, which therefore leaves the modes as they are.
    scaled = signal.resample_poly(series / scale, 1, factor, axis=1)
    span = observability_span(project(scaled[:1], scaled[1:], identification.block_rows), identification.weighting)
    orders = even_orders(identification.largest_order)
    diagram = stabilisation_diagram(span, orders, rate / factor, identification.stability)
    stable = stable_modes(diagram, identification.stability)
    if not stable:
        raise IdentificationError(
            f"no pole is stable over the orders up to {orders[-1]}; a longer or stronger record would do"
        )
    deviations = modal_deviations(stable, span, orders[-1], rate / factor)
    # Each channel had been divided by its scale; the shapes go back to the record's units.
    modes = tuple(
        IdentifiedMode(mode.frequency, mode.damping_ratio, mode.shape * scale[1:, 0], deviation)
        for mode, deviation in _supported(stable, deviations, span.projection)
    )
    if not modes:
        raise IdentificationError(
            f"{len(stable)} poles are stable, but noise explains them all; a longer or stronger record would do"
        )
    return modes


def _supported(
    modes: Sequence[DiagramPole], deviations: Sequence[ModalDeviation | None], projection: Projection
) -> list[tuple[DiagramPole, ModalDeviation | None]]:
    """The modes that the record supports, each with its deviation."""
    eigenvalues = np.array([mode.eigenvalue for mode in modes])
    growth = misfit_growth(eigenvalues, projection.inputs, projection.outputs).max(axis=1)
    return [
        (mode, deviation)
        for mode, deviation, without in zip(modes, deviations, growth, strict=True)
        if is_supported(mode.damping_ratio, deviation, float(without))
    ]
