"""Which poles are modes: those that stay as the model order rises."""

from collections.abc import Sequence
from dataclasses import dataclass

from core.arrays import ComplexVector
from core.modal import Poles, modal_assurance, poles
from core.subspace import ObservabilitySpan


@dataclass(frozen=True, slots=True, kw_only=True)
class Stability:
    """How far a pole may move from one order to the next and still be called stable."""

    frequency: float = 0.01
    """Relative change."""
    damping_ratio: float = 0.1
    """Relative change."""
    modal_assurance: float = 0.98
    """The least."""
    largest_damping_ratio: float = 0.2
    """A superstructure's mode is below this; what is above is the spectrum's background."""
    share: float = 0.5
    """Of the orders from its first appearance on in which a mode must be stable."""


@dataclass(frozen=True, slots=True, eq=False)
class DiagramPole:
    """One pole in the stabilisation diagram."""

    order: int
    eigenvalue: complex
    frequency: float
    """Hz."""
    damping_ratio: float
    shape: ComplexVector
    """(outputs,)"""
    is_stable: bool
    """It was there at the order before."""


def stabilisation_diagram(
    span: ObservabilitySpan, orders: Sequence[int], rate: float, stability: Stability
) -> tuple[DiagramPole, ...]:
    """The poles of every order with a plausible damping ratio, and whether they were there at the order before.

    Args:
        span: of the observability matrix, common to all orders.
        orders: rising; those the data does not hold are left out.
        rate: Hz.
        stability: what counts as the same pole.
    """
    diagram: list[DiagramPole] = []
    before: list[DiagramPole] = []
    for order in (order for order in orders if order <= span.columns.shape[1]):
        current = _judged(poles(*span.system(order), rate), order, before, stability)
        diagram += current
        before = current
    return tuple(diagram)


def _judged(found: Poles, order: int, before: Sequence[DiagramPole], stability: Stability) -> list[DiagramPole]:
    """The plausible poles of one order."""
    judged = []
    for value, frequency, ratio, shape in zip(
        found.eigenvalues, found.frequency, found.damping_ratio, found.shapes.T, strict=True
    ):
        if 0 < ratio < stability.largest_damping_ratio:
            pole = DiagramPole(order, complex(value), float(frequency), float(ratio), shape, is_stable=False)
            was_there = any(is_same(pole, other, stability) for other in before)
            judged.append(DiagramPole(order, pole.eigenvalue, pole.frequency, pole.damping_ratio, shape, was_there))
    return judged


def is_same(one: DiagramPole, other: DiagramPole, stability: Stability) -> bool:
    """Whether two poles of different orders are one mode."""
    return (
        abs(one.frequency - other.frequency) <= stability.frequency * other.frequency
        and abs(one.damping_ratio - other.damping_ratio) <= stability.damping_ratio * other.damping_ratio
        and modal_assurance(one.shape, other.shape) >= stability.modal_assurance
    )


def stable_modes(diagram: Sequence[DiagramPole], stability: Stability) -> tuple[DiagramPole, ...]:
    """The modes at the highest order that are stable there and in most orders since they first appeared.

    Returns:
        Lowest frequency first; empty if no pole is stable.
    """
    if not diagram:
        return ()
    orders = sorted({pole.order for pole in diagram})
    modes = []
    for pole in (pole for pole in diagram if pole.order == orders[-1] and pole.is_stable):
        seen = sorted({other.order for other in diagram if other.is_stable and is_same(pole, other, stability)})
        possible = [order for order in orders if order >= seen[0]]
        if len(seen) >= max(2, stability.share * len(possible)) and len(seen) >= 0.2 * len(orders):
            modes.append(pole)
    return tuple(sorted(modes, key=lambda mode: mode.frequency))


def even_orders(largest: int) -> range:
    """2, 4, ... up to the largest: every mode takes two states."""
    return range(2, largest + 1, 2)
