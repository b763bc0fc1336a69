"""By what angle are one sensor's horizontal axes turned against another's?

Along each of the building's axes every level answers to the motion of the base slab along that axis only, whatever
its transfer function. Of all angles by which a sensor's record can be turned back, the right one therefore leaves
the least that such a pair of transfer functions does not explain: the record is then most coherent with the other.
"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix

BAND = (0.1, 1.0)
"""Hz: above the accelerometers' drift, below the coupled modes of the superstructure."""
BINS = 8
"""Of the spectrum, over which a transfer function is taken to be constant."""
UNEXPLAINED = 0.2
"""Of the sensor's power: with more of it left at the best angle nothing is concluded."""
ALIKE = np.deg2rad(3.0)
"""rad, by which the angles that x and y tell, each alone, may differ."""
TOLD = np.deg2rad(10.0)
"""rad, largest standard deviation of either."""

Blocks = np.ndarray[tuple[int, int, int], np.dtype[np.complex128]]
"""(2, blocks, BINS), spectra of x and y."""
Costs = np.ndarray[tuple[int, int, int], np.dtype[np.float64]]
"""(3, 2, blocks), A, B and C of x and y."""


@dataclass(frozen=True, slots=True)
class RelativeAngle:
    """How a sensor's axes lie to another's, up to their signs."""

    angle: float
    """rad in (−π/2, π/2], by which the sensor's axes are turned, from x towards y."""
    std: float
    """rad, standard deviation; large where the motion lay along one line."""
    signs: tuple[float, float]
    """Of x and y: whether the turned record moves mostly with (1) or against (−1) the other."""


def relative_angle(reference: Matrix, sensor: Matrix, rate: float) -> RelativeAngle | None:
    """Angle of a sensor's axes against those of a reference.

    The cost over the angle φ is A cos²φ + B sin²φ − 2 C cosφ sinφ, whose minimum is known in closed form. Its standard
    deviation is the larger of that from the cost's curvature and of that from its slopes over the spectrum's parts,
    which holds where what the transfer functions miss is no noise (a layer that is not linear).

    Args:
        reference: (2, n) x and y of the reference.
        sensor: (2, n) x and y of the sensor, of the same quantity.
        rate: Hz.

    Returns:
        None if the record is too short, no angle makes the two coherent, or x and y tell different angles.
    """
    R, O = _blocks(reference, rate), _blocks(sensor, rate)  # noqa: E741  as in the docstring of _costs
    power = float(np.sum(np.abs(O) ** 2))
    if R.shape[1] < 2 or not power > 0:
        return None
    costs = _costs(R, O)
    φ, std, least = _least(costs)
    turned = np.cos(φ) * O + np.sin(φ) * np.array([-O[1], O[0]])
    if not (np.isfinite(std) and least < UNEXPLAINED * power and _agree(R, turned)):
        return None
    x, y = np.sign(np.sum((turned * R.conj()).real, axis=(1, 2)))
    return RelativeAngle(φ, std, (float(x), float(y)))


def _least(costs: Costs) -> tuple[float, float, float]:
    """The best angle in rad, its standard deviation, and the cost that is left, of (3, axes, blocks) A, B and C."""
    A, B, C = costs
    difference, mixed = float((B - A).sum()) / 2, float(C.sum())
    depth = float(np.hypot(difference, mixed))
    if depth == 0:
        return 0.0, np.inf, 0.0
    φ = float(np.arctan2(mixed, difference)) / 2
    least = max(float((A + B).sum()) / 2 - depth, 0.0)
    slopes = (B - A) / 2 * np.sin(2 * φ) - C * np.cos(2 * φ)
    free = 2 * A.size * (BINS - 1) - 1
    variance = max(least / free / (2 * depth), float(np.sum(slopes**2)) / (2 * depth) ** 2)
    return φ, float(np.sqrt(variance)), least


def _agree(R: Blocks, turned: Blocks) -> bool:
    """Whether x and y, each alone, tell the same angle: of a sensor off the centre of a torsion they do not.

    Each tells by how much of the other it holds beside the reference once both are turned by the common angle.
    """
    for axis in range(2):
        own, other = (_beside(R[axis], turned[one]) for one in (axis, 1 - axis))
        power = float(np.sum(np.abs(other) ** 2))
        by_block = np.sum((own * other.conj()).real, axis=1)
        leaked = float(by_block.sum()) / max(power, np.finfo(float).tiny)
        left = by_block - leaked * np.sum(np.abs(other) ** 2, axis=1)
        std = float(np.sqrt(np.sum(left**2))) / max(power, np.finfo(float).tiny)
        if std > TOLD or abs(leaked) > max(ALIKE, 3 * std):
            return False
    return True


def turned_back(samples: Matrix, angle: float) -> Matrix:
    """(2, n) along the building's axes, of (2, n) along axes that are turned by an angle in rad, from x towards y."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(np.array([[c, -s], [s, c]]) @ samples)


def _blocks(samples: Matrix, rate: float) -> Blocks:
    """(2, blocks, BINS) spectrum within the band."""
    count = samples.shape[1]
    frequency = np.fft.rfftfreq(count, 1 / rate)
    within = np.flatnonzero((frequency >= BAND[0]) & (frequency <= BAND[1]))
    within = within[: within.size // BINS * BINS]
    spectra = np.fft.rfft(samples * np.hanning(count), axis=1)[:, within]
    return np.asarray(spectra.reshape(2, -1, BINS))


def _costs(R: Blocks, O: Blocks) -> Costs:  # noqa: E741
    """(3, 2, blocks) A, B and C of what x cosφ − y sinφ of O holds beside R_x, and x sinφ + y cosφ beside R_y."""
    (xx, yx), (xy, yy) = [[_beside(R[axis], own) for own in O] for axis in range(2)]
    power = [[np.sum(np.abs(own) ** 2, axis=1) for own in axis] for axis in ((xx, yy), (yx, xy))]
    mixed = [np.sum((xx * yx.conj()).real, axis=1), -np.sum((xy * yy.conj()).real, axis=1)]
    return np.array([*power, mixed])


def _beside(
    reference: np.ndarray[tuple[int, int], np.dtype[np.complex128]],
    own: np.ndarray[tuple[int, int], np.dtype[np.complex128]],
) -> np.ndarray[tuple[int, int], np.dtype[np.complex128]]:
    """(blocks, BINS) what of it no transfer function makes of the reference."""
    power = np.sum(np.abs(reference) ** 2, axis=1, keepdims=True)
    cross = np.sum(own * reference.conj(), axis=1, keepdims=True)
    return np.asarray(own - cross / np.maximum(power, np.finfo(float).tiny) * reference)
