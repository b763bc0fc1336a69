"""Does a calibrated superstructure tell a measured floor from the others better than static interpolation?"""

import numpy as np

from core.arrays import Vector
from core.smoothing.all_floors import without_free_vibration
from core.smoothing.calibration import Calibration
from core.smoothing.line_weights import channel_covariance
from core.smoothing.spectral_lines import Lines
from core.smoothing.superstructure_model import Design
from core.smoothing.unmodelled_motion import static_flexibility


def left_out_errors(lines: Lines, design: Design, calibration: Calibration) -> tuple[float, float]:
    """Relative errors of floors between others, each told from all channels but its own.

    Args:
        lines: that were calibrated by.
        design: of the building.
        calibration: of the superstructure.

    Returns:
        By the calibrated superstructure, and by static interpolation (Guyan 1965); both 0 where no floor lies between
        others, or where the record is explained by noise alone.
    """
    inner = np.arange(1, design.measured.size)
    if inner.size == 0 or not calibration.hypothesis.is_random:
        return 0.0, 0.0
    spectra = without_free_vibration(lines, design, calibration.structure, calibration.parameters)
    covariance = channel_covariance(lines, design, calibration)
    model, static, power = 0.0, 0.0, 0.0
    for left in inner:
        others = np.delete(np.arange(len(spectra)), left)
        crossed = covariance[:, [left]][:, :, others]
        weights = np.linalg.solve(covariance[:, others][:, :, others].transpose(0, 2, 1), crossed.transpose(0, 2, 1))
        model += _power(spectra[left] - np.einsum("lo,ol->l", weights[:, :, 0], spectra[others]))
        static += _power(spectra[left] - _interpolation(design, int(left), others) @ spectra[others])
        power += _power(spectra[left])
    return float(np.sqrt(model / power)), float(np.sqrt(static / power))


def _interpolation(design: Design, left: int, others: np.ndarray) -> Vector:
    """Weights of the other channels, the base slab's among them, at a measured floor."""
    flexibility = static_flexibility(design)
    floors = design.measured[others[1:] - 1]
    seen = flexibility[np.ix_(floors, floors)]
    above = np.linalg.solve(seen, flexibility[floors, design.measured[left - 1]])
    return np.concatenate([[1 - above.sum()], above])


def _power(spectrum: np.ndarray) -> float:
    return float(np.sum(np.abs(spectrum) ** 2))
