"""Which modes do the spectra hold besides those that are known?"""

from collections.abc import Iterator
from dataclasses import replace
from math import log

import numpy as np

from core.arrays import ComplexMatrix, Matrix, Vector
from core.errors_in_variables import Fit, Lines, changes, fit, profiled
from core.modal_transfer import ModalTransfer, basis

STEP = 1.06
"""From one frequency that is tried to the next: about the half-power width of the damping ratio that is tried."""
RATIO = 0.04
"""Damping ratio that is tried; the fit then finds its own."""
TRIED = 3
"""Frequencies from which a further mode is looked for: those that promise most."""
WORTH = 16.0
"""Growth of twice the log-likelihood that makes a mode worth its four or more parameters: the best of thirty
frequencies in pure noise reaches 12 once in a hundred."""
LARGEST_RATIO = 0.3
"""More damping than that is the spectrum's background."""
APART = 0.06
"""Least distance of two frequencies, relative: nearer ones are one mode in two parts."""


def with_missing_modes(found: Fit, lines: Lines, least: float) -> Fit:
    """The fit with every further mode that the spectra ask for.

    A mode that is left out bends the damping ratios of its neighbours by several of their standard deviations long
    before it shows in the chi-square.

    Args:
        found: the fit with the modes that are known.
        lines: the spectra.
        least: rad/s, below which no mode is looked for.
    """
    while (better := next(_better(found, lines, least), None)) is not None:
        found = better
    return found


def _better(found: Fit, lines: Lines, least: float) -> Iterator[Fit]:
    """Fits with one mode more that are worth it, by what they promised."""
    frequencies = np.geomspace(least, lines.angular_frequency[-1], _count(least, lines.angular_frequency[-1]))
    known = found.transfer.angular_frequency
    frequencies = frequencies[np.all(np.abs(frequencies[:, None] / known - 1) > APART, axis=1)]
    promise, coefficients = _promise(found, lines, frequencies)
    scale = max(1.0, found.misfit)
    for i in np.argsort(-promise)[:TRIED]:
        if promise[i] < WORTH * scale:
            return
        more = fit(_with_mode(found.transfer, float(frequencies[i]), coefficients[i]), lines)
        if 2 * (found.cost - more.cost) >= WORTH * scale and _is_plausible(more.transfer):
            yield more


def _count(least: float, largest: float) -> int:
    return max(2, round(log(largest / least, STEP)))


def _is_plausible(transfer: ModalTransfer) -> bool:
    apart = np.diff(np.log(np.sort(transfer.angular_frequency)))
    return bool(np.all(transfer.damping_ratio < LARGEST_RATIO) and np.all(apart > APART))


def _with_mode(transfer: ModalTransfer, angular_frequency: float, driven: Vector) -> ModalTransfer:
    m = transfer.angular_frequency.size
    free = np.insert(transfer.free, [m, 2 * m], 0.0, axis=1) if transfer.free.size else transfer.free
    return replace(
        transfer,
        angular_frequency=np.append(transfer.angular_frequency, angular_frequency),
        damping_ratio=np.append(transfer.damping_ratio, RATIO),
        driven=np.insert(transfer.driven, m, driven, axis=1),
        free=free,
    )


def _promise(found: Fit, lines: Lines, frequencies: Vector) -> tuple[Vector, Matrix]:
    """Rao's score test of a further mode at each frequency.

    Returns:
        (frequencies,) by how much twice the log-likelihood would grow in noise of the assumed level, and
        (frequencies, floors) the shapes times participation with which it would.
    """
    w = lines.angular_frequency
    terms = basis(found.transfer, w)
    a, r, g = profiled(found.transfer, terms, lines)
    square, w_c = np.sum(np.abs(g) ** 2, axis=0), frequencies[:, None]
    mode = w**2 * np.reciprocal(w_c**2 - w**2 + 2j * RATIO * w_c * w)
    weight = np.asarray(a / lines.noise[1:, None])
    score = (mode.conj() @ (weight.conj() * r[1:]).T).real
    own = _own_information(np.asarray(mode), weight, g, square)
    shared = np.zeros((*score.shape, found.covariance.shape[0]))
    along = np.zeros((found.covariance.shape[0], w.size), dtype=complex)
    everything = list(changes(found.transfer, terms, lines, a))
    for floor, (parameters, _, change) in enumerate(everything, start=1):
        along[parameters] += change * (g[floor].conj() / square)
    for floor, (parameters, _, change) in enumerate(everything):
        shared[:, floor, parameters] += (mode.conj() @ (weight[floor].conj() * change).T).real
        shared[:, floor] -= (mode.conj() @ (weight[floor].conj() * g[floor + 1] * along).T).real
    left = own - shared @ found.inverse_information @ shared.transpose(0, 2, 1)
    coefficients = np.linalg.solve(left, score[..., None])[..., 0]
    return np.asarray(2 * np.sum(score * coefficients, axis=1)), np.asarray(coefficients)


def _own_information(mode: ComplexMatrix, weight: ComplexMatrix, g: ComplexMatrix, square: Vector) -> Matrix:
    """(frequencies, floors, floors) JᵀJ of each further mode's coefficients."""
    floors = len(weight)
    pairs = np.eye(floors)[..., None] * np.abs(weight) ** 2 - (
        weight.conj()[:, None] * g[1:, None] * g[None, 1:].conj() * weight[None] / square
    )
    return np.asarray((np.abs(mode) ** 2 @ pairs.real.reshape(floors**2, -1).T).reshape(-1, floors, floors))
