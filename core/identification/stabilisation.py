"""Which poles are modes: those that stay as the model order rises."""

from collections.abc import Sequence
from dataclasses import dataclass

from core.arrays import ComplexVector
from core.identification.modes import Poles, modal_assurance, poles
from core.identification.subspace import ObservabilitySpan


@dataclass(frozen=True, slots=True, kw_only=True)
class Stability:
    """How far a pole may move from one order to the next and still be called stable."""

    frequency: float = 0.02
    """Relative change."""
    damping_ratio: float = 0.3
    """Relative change."""
    modal_assurance: float = 0.95
    """The least."""
    largest_damping_ratio: float = 0.2
    """A superstructure's mode is below this; what is above is the spectrum's background."""
    highest_frequency: float = 0.4
    """Share of the sampling rate, above which the anti-alias filter has taken the motion away."""
    share: float = 0.5
    """Of the orders from its first appearance on in which a mode must be stable."""
    least_count: int = 3
    """Orders in which a mode must be stable."""
    least_order: int = 10
    """Of a pole that is reported: lower orders are biased by the modes they leave out."""


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
        current = _judged(poles(*span.system(order), rate), rate, order, before, stability)
        diagram += current
        before = current
    return tuple(diagram)


def _judged(
    found: Poles, rate: float, order: int, before: Sequence[DiagramPole], stability: Stability
) -> list[DiagramPole]:
    """The plausible poles of one order."""
    judged = []
    for value, frequency, ratio, shape in zip(
        found.eigenvalues, found.frequency, found.damping_ratio, found.shapes.T, strict=True
    ):
        within = frequency < stability.highest_frequency * rate
        if within and 0 < ratio < stability.largest_damping_ratio:
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
    """The modes: columns of the diagram in which a pole is stable in most orders since it first appeared.

    Returns:
        Of each column the pole with the median damping ratio among the orders that are high enough to be unbiased;
        lowest frequency first; empty if no pole is stable.
    """
    orders = sorted({pole.order for pole in diagram})
    modes = []
    for column in _columns(diagram, stability):
        possible = [order for order in orders if order >= column[0].order]
        unbiased = [pole for pole in column if pole.order >= stability.least_order]
        if unbiased and len(column) >= max(stability.least_count, stability.share * len(possible)):
            modes.append(sorted(unbiased, key=lambda pole: pole.damping_ratio)[(len(unbiased) - 1) // 2])
    return tuple(sorted(modes, key=lambda mode: mode.frequency))


def _columns(diagram: Sequence[DiagramPole], stability: Stability) -> list[list[DiagramPole]]:
    """The stable poles, each appended to the column whose last pole it repeats at a higher order, or a new one."""
    columns: list[list[DiagramPole]] = []
    for pole in (pole for pole in diagram if pole.is_stable):
        for column in columns:
            if column[-1].order < pole.order and is_same(pole, column[-1], stability):
                column.append(pole)
                break
        else:
            columns.append([pole])
    return columns


def even_orders(largest: int) -> range:
    """2, 4, ... up to the largest: every mode takes two states."""
    return range(2, largest + 1, 2)
