"""Which modes do the spectra hold besides those that are known?"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import log

import numpy as np
from scipy import special

from core.arrays import ComplexMatrix, Matrix, Vector
from core.identification.errors_in_variables import Fit, NoisyLines, changes, fit, profiled
from core.identification.modal_transfer import ModalTransfer, basis, lateness

STEP = 1.06
"""From one frequency that is tried to the next: about the half-power width of the damping ratio that is tried."""
RATIO = 0.04
"""Damping ratio that is tried; the fit then finds its own."""
TRIED = 2
"""Frequencies from which a further mode is looked for: those that promise most."""
WORTH = 3.0
"""Growth of twice the log-likelihood for each of its parameters that makes a mode worth them. Akaike's is two; more,
for it is the best of many frequencies."""
LARGEST_RATIO = 0.3
"""More damping than that is the spectrum's background."""
APART = 0.06
"""Relative distance from a known mode at which one more is tried."""
DISTINCT = 0.02
"""Least relative distance of two modes: nearer ones are one in two parts."""


@dataclass(frozen=True, slots=True, eq=False)
class Candidates:
    """Further modes at some frequencies, by Rao's score test: what each is to be expected to do."""

    angular_frequency: Vector
    """(candidates,) rad/s."""
    promise: Vector
    """(candidates,) growth of twice the log-likelihood, in noise as large as the misfit says."""
    driven: Matrix
    """(candidates, floors) their shapes times participation."""
    move: Matrix
    """(candidates, parameters) by how much the parameters of the known modes would change."""


def with_missing_modes(found: Fit, lines: NoisyLines, least: float) -> Fit:
    """The fit with every further mode that the spectra ask for.

    A mode that is left out bends the damping ratios of its neighbours by several of their standard deviations long
    before it shows in the chi-square. So the covariance also covers what those left out would change, each as far as
    it may be there. That is of first order: the highest mode found stands for all above it, and may be off by more.

    Args:
        found: the fit with the modes that are known.
        lines: the spectra.
        least: rad/s, below which no mode is looked for.
    """
    while True:
        candidates = _candidates(found, lines, _frequencies(found, lines, least))
        better = next(_better(found, lines, candidates), None)
        if better is None:
            return _widened(found, candidates)
        found = better


def _frequencies(found: Fit, lines: NoisyLines, least: float) -> Vector:
    """(candidates,) rad/s, apart from those of the known modes."""
    largest = float(lines.angular_frequency[-1])
    frequencies = np.geomspace(least, largest, max(2, round(log(largest / least, STEP))))
    known = found.transfer.angular_frequency
    return frequencies[np.all(np.abs(frequencies[:, None] / known - 1) > APART, axis=1)]


def _better(found: Fit, lines: NoisyLines, candidates: Candidates) -> Iterator[Fit]:
    """Fits with one mode more that are worth it, by what they promised."""
    worth = WORTH * _parameters(found.transfer)
    for i in np.argsort(-candidates.promise)[:TRIED]:
        if candidates.promise[i] < worth:
            return
        frequency = float(candidates.angular_frequency[i])
        start = _with_mode(_moved(found.transfer, candidates.move[i]), frequency, candidates.driven[i])
        more = fit(start, lines)
        growth = 2 * (found.cost - more.cost) / max(1.0, found.misfit)
        is_known = more.converged and np.isfinite(more.inverse_information).all()
        if is_known and growth >= worth and _is_plausible(more.transfer):
            yield more


def _parameters(transfer: ModalTransfer) -> int:
    """Of one mode: frequency, damping ratio, and at each floor its part and that of its free decay."""
    floors = len(transfer.driven)
    return 2 + floors + (2 * floors if transfer.free.size else 0)


def _widened(found: Fit, candidates: Candidates) -> Fit:
    """The fit with the covariance of its average with every candidate, by Akaike's weights (Burnham, Anderson 2002)."""
    exponents = candidates.promise / 2 - _parameters(found.transfer)
    weight = special.softmax(np.append(exponents, 0.0))[:-1]
    spread = candidates.move.T @ (weight[:, None] * candidates.move)
    return replace(found, covariance=found.covariance + spread)


def _is_plausible(transfer: ModalTransfer) -> bool:
    apart = np.diff(np.log(np.sort(transfer.angular_frequency)))
    return bool(np.all(transfer.damping_ratio < LARGEST_RATIO) and np.all(apart > DISTINCT))


def _moved(transfer: ModalTransfer, move: Vector) -> ModalTransfer:
    """The transfer moved, or as it was where a mode would no longer decay."""
    moved = transfer.moved(move)
    return moved if np.all(moved.damping_ratio > 0) and np.all(moved.angular_frequency > 0) else transfer


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


def _candidates(found: Fit, lines: NoisyLines, frequencies: Vector) -> Candidates:
    """What a further mode at each of the frequencies would do."""
    w = lines.angular_frequency
    terms = basis(found.transfer, w)
    a, r, g = profiled(found.transfer, terms, lines)
    square, w_c = np.sum(np.abs(g) ** 2, axis=0), frequencies[:, None]
    mode: ComplexMatrix = np.multiply(w**2, np.reciprocal(w_c**2 - w**2 + 2j * RATIO * w_c * w))
    weight = np.asarray(a * lateness(found.transfer, w) / lines.noise[1:, None])
    score = (mode.conj() @ (weight.conj() * r[1:]).T).real
    shared = np.zeros((*score.shape, len(found.covariance)))
    along = np.zeros((len(found.covariance), w.size), dtype=complex)
    known = [(parameters, change) for parameters, _, change in changes(found.transfer, terms, lines, a)]
    for (parameters, change), of_floor in zip(known, g[1:], strict=True):
        along[parameters] += change * (of_floor.conj() / square)
    for floor, (parameters, change) in enumerate(known):
        shared[:, floor, parameters] += (mode.conj() @ (weight[floor].conj() * change).T).real
        shared[:, floor] -= (mode.conj() @ (weight[floor].conj() * g[floor + 1] * along).T).real
    regression = shared @ found.inverse_information
    left = _own_information(mode, weight, g, square) - regression @ shared.transpose(0, 2, 1)
    driven = np.asarray(np.linalg.solve(left, score[..., None])[..., 0], dtype=float)
    promise = 2 * np.sum(score * driven, axis=1) / max(1.0, found.misfit)
    return Candidates(frequencies, promise, driven, -np.einsum("cf,cfk->ck", driven, regression))


def _own_information(mode: ComplexMatrix, weight: ComplexMatrix, g: ComplexMatrix, square: Vector) -> Matrix:
    """(frequencies, floors, floors) JᵀJ of each further mode's coefficients."""
    floors = len(weight)
    pairs = np.eye(floors)[..., None] * np.abs(weight) ** 2 - (
        weight.conj()[:, None] * g[1:, None] * g[None, 1:].conj() * weight[None] / square
    )
    return np.asarray((np.abs(mode) ** 2 @ pairs.real.reshape(floors**2, -1).T).reshape(-1, floors, floors))
