"""Gradient of the cost where nothing acts but the base slab and all is in units of the channels' noise.

Every derivative of a channel then is its clock's factor times a sum, with real weights, of complex series that all
channels share: accelerations of the modes, their changes by the squared frequencies and by the damping, and free
vibrations. Products of the series, summed over the lines, give the gradient and the normal matrix for any number of
parameters and channels; only the derivatives' parts along h are computed line by line.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from core.arrays import ComplexMatrix, Indices, Matrix, Tensor, Vector
from core.estimators.frame.evaluation import Evaluation
from core.estimators.frame.free_vibration import free_vibration, pole_changes, vibration_changes
from core.estimators.frame.likelihood import real_times
from core.estimators.frame.model import Layout, Superstructure
from core.signals.spectra import real_parts

BLOCK = 4000
"""Lines computed at once, so that the series need some 2 MB however long a record is. With the 3,563 lines of a record
of 180 s, blocks of 500, 1,000 and 1,800 took 1.4, 1.2 and 1.1 times as long."""


@dataclass(frozen=True, slots=True, eq=False)
class Free:
    """The free parameters by kind."""

    structural: Indices
    """Places in core.estimators.frame.model.Layout."""
    gains: Indices
    """Channels."""
    delays: Indices
    """Channels."""
    transients: Indices
    """Places among all transients."""

    @classmethod
    def of(cls, free: Indices, layout: Layout) -> "Free":
        """Free parameters, given their rising places in the layout."""
        kinds = slice(0, layout.structural), layout.gains, layout.delays, layout.transients
        return cls(*(free[(free >= kind.start) & (free < kind.stop)] - kind.start for kind in kinds))


@dataclass(frozen=True, eq=False)  # without slots, for the cached properties
class Order:
    """Rows of the series."""

    modes: int
    channels: int
    vibrating: int
    """Number of modes whose free vibration counts; 0 for a record at rest."""
    late: int
    """Number of series by a delay; 0 where none is free."""

    @cached_property
    def by_mode(self) -> slice:
        """Accelerations of the modes by a unit load, then their changes by the squared frequencies, by hysteretic and
        by viscous damping, with the opposite sign."""
        return slice(0, self.base)

    @cached_property
    def base(self) -> int:
        """Acceleration of the base slab."""
        return 4 * self.modes

    @cached_property
    def vibration(self) -> slice:
        """Free vibration, real and imaginary part of each mode."""
        return slice(self.base + 1, self.base + 1 + 2 * self.vibrating)

    @cached_property
    def moved(self) -> slice:
        """Changes of the free vibration by the real and the imaginary part of each mode's pole."""
        return slice(self.vibration.stop, self.vibration.stop + 2 * self.vibrating)

    @cached_property
    def delayed(self) -> slice:
        """Changes by a delay: of the modes' accelerations, of the base slab's, of the modes' free vibrations."""
        return slice(self.moved.stop, self.moved.stop + self.late)

    @cached_property
    def residual(self) -> slice:
        """Residuals of the channels, which no derivative is a sum of."""
        return slice(self.delayed.stop, self.delayed.stop + self.channels)


@dataclass(frozen=True, slots=True, eq=False)
class Weights:
    """Real weights of the series in the derivatives."""

    strength: Vector
    """(channels,) gain over the root mean square of the noise's white part."""
    seen: Matrix
    """(channels, modes) the modes at the channels times `strength`; 0 at the base slab."""
    whole: Tensor
    """(free, channels, series)."""
    along: Matrix
    """(structural, products) of the products in `_structural_along`."""


def base_driven_gradient(here: Evaluation) -> tuple[Vector, Matrix]:
    """(free,) descent of the misfit, and (free, free) its normal matrix, of an evaluation without random motion."""
    layout = here.problem.design.layout
    free = Free.of(here.problem.hypothesis.free, layout)
    vibrating = 0 if here.problem.lines.at_rest else layout.floors
    late = layout.floors + 1 + vibrating if free.delays.size else 0
    order = Order(layout.floors, layout.channels, vibrating, late)
    weights = _weights(here, free, order)
    parameters, _, count = weights.whole.shape
    products, along = np.zeros((order.residual.stop, order.residual.stop)), np.zeros((parameters, parameters))
    for first in range(0, here.amplitude.size, BLOCK):
        part = here.on(slice(first, first + BLOCK))
        turned = part.given.sensors * (np.sqrt(part.problem.lines.colour) / weights.strength[:, None])
        series = _series(part, order, turned)
        flat, flat_along = real_parts(series), real_parts(_along(part, series, turned, free, order, weights))
        products += flat @ flat.T
        along += flat_along @ flat_along.T
    whole = weights.whole.reshape(parameters, -1)
    weighted = (weights.whole.reshape(-1, count) @ products[:count, :count]).reshape(parameters, -1)
    return 2 * whole @ products[order.residual, :count].ravel(), 2 * (weighted @ whole.T - along)


def _series(here: Evaluation, order: Order, turned: ComplexMatrix) -> ComplexMatrix:
    """(series, lines) in `order`, over the root of the noise's colour.

    Args:
        here: a part of the lines.
        order: of the rows.
        turned: (channels, lines) factor of the channels' clocks.
    """
    lines = here.problem.lines
    w, colour = lines.angular, np.sqrt(lines.colour)
    series = np.empty((order.residual.stop, w.size), dtype=complex)
    series[order.base] = here.amplitude / colour
    accelerations, stiff, hysteretic, viscous = series[order.by_mode].reshape(4, order.modes, -1)
    np.multiply(here.given.compliance, w**2 * series[order.base], out=accelerations)
    np.multiply(accelerations, here.given.compliance, out=stiff)
    np.multiply(stiff, 1j, out=hysteretic)
    np.multiply(stiff, 1j * w, out=viscous)
    if order.vibrating:
        amplitudes = here.parameters[here.problem.design.layout.transients]
        series[order.vibration] = free_vibration(here.structure, w, lines.samples, lines.rate).reshape(-1, w.size)
        series[order.moved] = vibration_changes(here.structure, lines, amplitudes).reshape(-1, w.size)
        series[order.vibration.start : order.moved.stop] /= colour
    if order.late:
        late = np.concatenate([accelerations, series[[order.base]], _vibrations(here, series, order)])
        np.multiply(late, -1j * w, out=series[order.delayed])
    np.multiply(turned.conj(), here.residual, out=series[order.residual])
    return series


def _vibrations(here: Evaluation, series: ComplexMatrix, order: Order) -> ComplexMatrix:
    """(vibrating, lines) free vibrations of the modes."""
    amplitudes = here.parameters[here.problem.design.layout.transients][: 2 * order.vibrating]
    vibration = series[order.vibration].reshape(order.vibrating, 2, series.shape[1])
    return np.asarray(np.sum(amplitudes.reshape(-1, 2, 1) * vibration, axis=1))


def _along(
    here: Evaluation, series: ComplexMatrix, turned: ComplexMatrix, free: Free, order: Order, weights: Weights
) -> ComplexMatrix:
    """(free, lines) parts of the derivatives along h."""
    towards = here.whitened.direction.conj()
    through = towards * turned
    seen = np.asarray(real_times(weights.seen.T, through))
    along = [real_times(weights.along, _structural_products(here, series, through, seen, order))]
    if free.gains.size or free.delays.size:
        modelled = towards * (here.amplitude * here.given.base + here.free_vibration)
        along += [modelled[free.gains], -1j * here.problem.lines.angular * modelled[free.delays]]
    if free.transients.size:
        along += [series[order.vibration][free.transients] * seen[free.transients // 2]]
    return np.concatenate(along) if len(along) > 1 else along[0]


def _structural_products(
    here: Evaluation, series: ComplexMatrix, through: ComplexMatrix, seen: ComplexMatrix, order: Order
) -> ComplexMatrix:
    """(products, lines) of the series, of which the parts of the structure's derivatives along h are sums.

    Args:
        here: a part of the lines.
        series: in `order`.
        through: (channels, lines) of the channels along h.
        seen: (modes, lines) of the modes along h.
        order: of the series.
    """
    floors, modes, vibrating, size = order.channels - 1, order.modes, order.vibrating, through.shape[1]
    ends = np.cumsum([floors * modes, 3 * modes, floors * vibrating, 2 * vibrating])
    products = np.empty((ends[-1], size), dtype=complex)
    shapes, rates, moved, poles = np.split(products, ends[:-1])
    np.multiply(through[1:, None], series[:modes], out=shapes.reshape(floors, modes, size))
    np.multiply(series[modes : order.base].reshape(3, modes, size), seen, out=rates.reshape(3, modes, size))
    if vibrating:
        np.multiply(through[1:, None], _vibrations(here, series, order), out=moved.reshape(floors, vibrating, size))
        by_poles = series[order.moved].reshape(vibrating, 2, size)
        np.multiply(by_poles, seen[:, None], out=poles.reshape(vibrating, 2, size))
    return products


def _weights(here: Evaluation, free: Free, order: Order) -> Weights:
    structure, layout = here.structure, here.problem.design.layout
    load, modes, measured = structure.inputs[:, 0], order.modes, here.problem.design.measured
    strength = np.exp(here.parameters[layout.gains]) / np.sqrt(here.problem.lines.noise)
    seen = np.vstack([np.zeros(modes), structure.shapes[measured]]) * strength[:, None]
    rates, shapes = _rates(structure)[free.structural], structure.changes[1][free.structural]
    moved = np.zeros((free.structural.size, layout.channels, modes))
    moved[:, 1:] = shapes[:, measured] * strength[1:, None]
    by_mode = moved * load + seen * _load_changes(structure)[free.structural, None]
    whole = np.zeros((here.problem.hypothesis.free.size, layout.channels, order.delayed.stop))
    by_structure, by_gains, by_delays, by_transients = np.split(
        whole, np.cumsum([free.structural.size, free.gains.size, free.delays.size])
    )
    by_structure[..., :modes] = by_mode
    by_structure[..., modes : order.base] = (seen[:, None] * rates[:, None]).reshape(*moved.shape[:2], -1)
    along = [by_mode[:, 1:], rates]
    gained = np.zeros((layout.channels, order.delayed.start))
    gained[:, :modes], gained[:, order.base] = seen * load, strength
    if order.vibrating:
        amplitudes, twice = here.parameters[layout.transients], np.repeat(seen, 2, axis=1)
        poles = pole_changes(structure)[free.structural]
        by_poles = np.stack([poles.real, poles.imag], axis=-1)
        by_structure[..., order.vibration] = np.repeat(moved, 2, axis=2) * amplitudes
        by_structure[..., order.moved] = (seen[:, :, None] * by_poles[:, None]).reshape(*moved.shape[:2], -1)
        along += [moved[:, 1:], by_poles]
        gained[:, order.vibration] = twice * amplitudes
        for row, place in zip(by_transients, free.transients, strict=True):
            row[:, order.vibration.start + place] = twice[:, place]
    by_gains[np.arange(free.gains.size), free.gains, : order.delayed.start] = gained[free.gains]
    if order.late:
        delayed = np.hstack([gained[:, :modes], strength[:, None], seen[:, : order.vibrating]])
        by_delays[np.arange(free.delays.size), free.delays, order.delayed] = delayed[free.delays]
    return Weights(strength, seen, whole, np.hstack([each.reshape(free.structural.size, -1) for each in along]))


def _rates(structure: Superstructure) -> Tensor:
    """(structural, 3, modes) derivatives of the squared frequencies, of the hysteretic damping ρ λ η and of the viscous
    one ρ (α λ + β), times less the base slab's load."""
    λ, ρ, (α, η, β) = structure.squared, structure.modal_damping, structure.damping
    of_squared, rates = structure.changes[0], 4 + 2 * structure.mass.size
    changes = np.stack([of_squared, of_squared * (ρ * η), of_squared * (ρ * α)], axis=1)
    changes[rates, 2] = ρ * λ * α
    changes[rates + 1, 1] = ρ * λ * η
    changes[rates + 2, 2] = ρ * β
    changes[rates + 3 :, 1], changes[rates + 3 :, 2] = np.diag(ρ * λ * η), np.diag(ρ * (λ * α + β))
    return np.asarray(changes * -structure.inputs[:, 0])


def _load_changes(structure: Superstructure) -> Matrix:
    """(structural, modes) derivatives of the modes' load by the base slab's acceleration."""
    mass, masses = structure.mass, slice(1 + structure.mass.size, 1 + 2 * structure.mass.size)
    of_load = np.asarray(np.tensordot(structure.changes[1], mass, (1, 0)))
    of_load[masses] += (np.diag(mass) - np.outer(mass, mass) / mass.sum()) @ structure.shapes
    return of_load
