"""Stabilisation diagram: modes are the poles that persist as the model order rises."""

from collections.abc import Sequence
from dataclasses import dataclass

from core.arrays import ComplexVector
from core.identification.modes import Poles, modal_assurance, poles
from core.identification.subspace import ExtendedObservability


@dataclass(frozen=True, slots=True, kw_only=True)
class StabilityCriteria:
    """Criteria by which a pole is stable from one order to the next, and a column of stable poles is a mode."""

    frequency: float = 0.02
    """Largest relative change of the natural frequency."""
    damping_ratio: float = 0.3
    """Largest relative change of the damping ratio."""
    modal_assurance: float = 0.95
    """Smallest modal assurance criterion."""
    largest_damping_ratio: float = 0.2
    """Modes of a superstructure are below; poles above describe the background of the spectrum."""
    highest_frequency: float = 0.4
    """Ratio to the sampling rate, above which the anti-alias filter has removed the motion."""
    share: float = 0.5
    """Smallest share of the orders, counted from a mode's first appearance, in which it is stable."""
    least_count: int = 3
    """Smallest number of orders in which a mode is stable."""
    least_order: int = 10
    """Lowest order of a reported pole. Lower orders are biased by the modes that they leave out."""


@dataclass(frozen=True, slots=True, eq=False)
class DiagramPole:
    """A pole in the stabilisation diagram."""

    order: int
    eigenvalue: complex
    frequency: float
    """Hz, undamped natural frequency."""
    damping_ratio: float
    shape: ComplexVector
    """(outputs,)"""
    is_stable: bool
    """True if the previous order has the same pole."""


def stabilisation_diagram(
    observability: ExtendedObservability, orders: Sequence[int], rate: float, criteria: StabilityCriteria
) -> tuple[DiagramPole, ...]:
    """Poles of every order that have a plausible frequency and damping ratio, marked as stable or not.

    Args:
        observability: the extended observability matrix common to all orders.
        orders: rising; orders above the rank of the data are left out.
        rate: Hz.
        criteria: by which two poles are the same.
    """
    diagram: list[DiagramPole] = []
    previous: list[DiagramPole] = []
    for order in (order for order in orders if order <= observability.columns.shape[1]):
        current = _plausible_poles(poles(*observability.system(order), rate), rate, order, previous, criteria)
        diagram += current
        previous = current
    return tuple(diagram)


def _plausible_poles(
    estimated: Poles, rate: float, order: int, previous: Sequence[DiagramPole], criteria: StabilityCriteria
) -> list[DiagramPole]:
    """Poles of one order with a plausible frequency and damping ratio."""
    plausible = []
    for value, frequency, ratio, shape in zip(
        estimated.eigenvalues, estimated.frequency, estimated.damping_ratio, estimated.shapes.T, strict=True
    ):
        is_in_band = frequency < criteria.highest_frequency * rate
        if is_in_band and 0 < ratio < criteria.largest_damping_ratio:
            pole = DiagramPole(order, complex(value), float(frequency), float(ratio), shape, is_stable=False)
            is_stable = any(is_same_pole(pole, other, criteria) for other in previous)
            plausible.append(DiagramPole(order, pole.eigenvalue, pole.frequency, pole.damping_ratio, shape, is_stable))
    return plausible


def is_same_pole(one: DiagramPole, other: DiagramPole, criteria: StabilityCriteria) -> bool:
    """True if two poles of different orders belong to the same mode."""
    return (
        abs(one.frequency - other.frequency) <= criteria.frequency * other.frequency
        and abs(one.damping_ratio - other.damping_ratio) <= criteria.damping_ratio * other.damping_ratio
        and modal_assurance(one.shape, other.shape) >= criteria.modal_assurance
    )


def stable_modes(diagram: Sequence[DiagramPole], criteria: StabilityCriteria) -> tuple[DiagramPole, ...]:
    """One pole for every mode: for every column of the diagram that is stable in most orders since it first appeared.

    Returns:
        The pole with the median damping ratio among the unbiased orders of each column, lowest frequency first; empty
        if no pole is stable.
    """
    orders = sorted({pole.order for pole in diagram})
    modes = []
    for column in _columns(diagram, criteria):
        possible = [order for order in orders if order >= column[0].order]
        unbiased = [pole for pole in column if pole.order >= criteria.least_order]
        if unbiased and len(column) >= max(criteria.least_count, criteria.share * len(possible)):
            modes.append(sorted(unbiased, key=lambda pole: pole.damping_ratio)[(len(unbiased) - 1) // 2])
    return tuple(sorted(modes, key=lambda mode: mode.frequency))


def _columns(diagram: Sequence[DiagramPole], criteria: StabilityCriteria) -> list[list[DiagramPole]]:
    """Stable poles in columns: each joins the column whose last pole, of a lower order, is the same, or a new one."""
    columns: list[list[DiagramPole]] = []
    for pole in (pole for pole in diagram if pole.is_stable):
        for column in columns:
            if column[-1].order < pole.order and is_same_pole(pole, column[-1], criteria):
                column.append(pole)
                break
        else:
            columns.append([pole])
    return columns


def even_orders(largest: int) -> range:
    """2, 4, ... up to the largest order: every mode takes two states."""
    return range(2, largest + 1, 2)
