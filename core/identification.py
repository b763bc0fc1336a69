"""The fixed-base modes of a superstructure from its recorded motion: the whole of the paper's section 4."""

from dataclasses import dataclass, field

import numpy as np
from scipy import signal

from core.arrays import ComplexVector, Matrix, Vector
from core.errors import IdentificationError
from core.modal_uncertainty import ModalDeviation, modal_deviations
from core.projection import project
from core.stabilisation import DiagramPole, Stability, even_orders, stabilisation_diagram, stable_modes
from core.subspace import Weighting, cva, observability_span


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
        IdentificationError: the record is too short or at rest, or no pole is stable.
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
    modes = stable_modes(diagram, identification.stability)
    if not modes:
        raise IdentificationError(
            f"no pole is stable over the orders up to {orders[-1]}; a longer or stronger record would do"
        )
    deviations = modal_deviations(modes, span, orders[-1], rate / factor)
    return tuple(_in_units(mode, scale[1:, 0], std) for mode, std in zip(modes, deviations, strict=True))


def _in_units(mode: DiagramPole, scale: Vector, deviation: ModalDeviation | None) -> IdentifiedMode:
    """The mode with its shape in the record's units: each channel had been divided by its scale."""
    return IdentifiedMode(mode.frequency, mode.damping_ratio, mode.shape * scale, deviation)
