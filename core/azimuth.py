"""By what angle are one sensor's horizontal axes turned against another's?

Along each of the building's axes every level answers to the motion of the base slab along that axis only, whatever
its transfer function. Of all angles by which a sensor's record can be turned back, the right one therefore leaves
the least that such a pair of transfer functions does not explain: the record is then most coherent with the other.
"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector

BAND = (0.1, 1.0)
"""Hz: above the accelerometers' drift, below the coupled modes of the superstructure."""
BINS = 8
"""Of the spectrum, over which a transfer function is taken to be constant."""
UNEXPLAINED = 0.2
"""Of the sensor's power: with more of it left at the best angle nothing is concluded."""


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
        None if the record is too short, or no angle makes the two coherent.
    """
    R, O = _blocks(reference, rate), _blocks(sensor, rate)  # noqa: E741  as in the docstring of _costs
    if R.shape[1] < 2:
        return None
    A, B, C = _costs(R, O)
    difference, mixed = float((B - A).sum()) / 2, float(C.sum())
    φ = np.arctan2(mixed, difference) / 2
    depth = float(np.hypot(difference, mixed))
    least = float((A + B).sum()) / 2 - depth
    power = float(np.sum(np.abs(O) ** 2))
    if not (power > 0 and depth > 0 and least < UNEXPLAINED * power):
        return None
    slopes = (B - A) / 2 * np.sin(2 * φ) - C * np.cos(2 * φ)
    free = 2 * 2 * R.shape[1] * (BINS - 1) - 1
    variance = max(max(least, 0.0) / free / (2 * depth), float(np.sum(slopes**2)) / (2 * depth) ** 2)
    turned = np.cos(φ) * O + np.sin(φ) * np.array([-O[1], O[0]])
    x, y = np.sign(np.sum((turned * R.conj()).real, axis=(1, 2)))
    return RelativeAngle(float(φ), float(np.sqrt(variance)), (float(x), float(y)))


def turned_back(samples: Matrix, angle: float) -> Matrix:
    """(2, n) along the building's axes, of (2, n) along axes that are turned by an angle in rad, from x towards y."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(np.array([[c, -s], [s, c]]) @ samples)


def _blocks(samples: Matrix, rate: float) -> np.ndarray[tuple[int, int, int], np.dtype[np.complex128]]:
    """(2, blocks, BINS) spectrum within the band."""
    count = samples.shape[1]
    frequency = np.fft.rfftfreq(count, 1 / rate)
    within = np.flatnonzero((frequency >= BAND[0]) & (frequency <= BAND[1]))
    within = within[: within.size // BINS * BINS]
    spectra = np.fft.rfft(samples * np.hanning(count), axis=1)[:, within]
    return np.asarray(spectra.reshape(2, -1, BINS))


def _costs(
    R: np.ndarray[tuple[int, int, int], np.dtype[np.complex128]],
    O: np.ndarray[tuple[int, int, int], np.dtype[np.complex128]],  # noqa: E741
) -> tuple[Vector, Vector, Vector]:
    """(2 · blocks,) each, A, B and C: what x cosφ − y sinφ of O holds beside R_x, and x sinφ + y cosφ beside R_y."""
    power = np.sum(np.abs(R) ** 2, axis=2, keepdims=True)
    beside = [
        own - np.sum(own * R.conj(), axis=2, keepdims=True) / np.maximum(power, np.finfo(float).tiny) * R
        for own in (np.broadcast_to(O[0], O.shape), np.broadcast_to(O[1], O.shape))
    ]
    xx, yy = (np.sum(np.abs(one) ** 2, axis=2) for one in beside)
    xy = np.sum((beside[0] * beside[1].conj()).real, axis=2)
    A, B, C = np.concatenate([xx[0], yy[1]]), np.concatenate([yy[0], xx[1]]), np.concatenate([xy[0], -xy[1]])
    return A, B, C
