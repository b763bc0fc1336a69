"""Errors of measured floors between others, each estimated from all channels but its own."""

from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.estimators.frame.all_floors import without_free_vibration
from core.estimators.frame.calibration import Calibration
from core.estimators.frame.line_weights import channel_covariance
from core.estimators.frame.spectral_lines import Lines
from core.estimators.frame.superstructure_model import Design
from core.estimators.frame.unmodelled_motion import static_flexibility


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Relative errors of left-out floors; 0 where no floor lies between others, or where noise explains the record."""

    model: float
    """By the calibrated superstructure."""
    static: float
    """By static interpolation (Guyan 1965)."""

    @property
    def share(self) -> float | None:
        """Of the interpolation's error that the model leaves; None where the record does not show it."""
        return self.model / self.static if self.static > 0 else None


def left_out(lines: Lines, design: Design, calibration: Calibration) -> LeftOut:
    """Errors of floors between others.

    Args:
        lines: that were calibrated by.
        design: of the building.
        calibration: of the superstructure.
    """
    inner = np.arange(1, design.measured.size)
    if inner.size == 0 or not calibration.hypothesis.is_random:
        return LeftOut(0.0, 0.0)
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
    return LeftOut(float(np.sqrt(model / power)), float(np.sqrt(static / power)))


def _interpolation(design: Design, left: int, others: np.ndarray) -> Vector:
    """Weights of the other channels, the base slab's among them, at a measured floor."""
    flexibility = static_flexibility(design)
    floors = design.measured[others[1:] - 1]
    seen = flexibility[np.ix_(floors, floors)]
    above = np.linalg.solve(seen, flexibility[floors, design.measured[left - 1]])
    return np.concatenate([[1 - above.sum()], above])


def _power(spectrum: np.ndarray) -> float:
    return float(np.sum(np.abs(spectrum) ** 2))
