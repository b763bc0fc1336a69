"""Does a calibrated superstructure tell a measured floor from the others better than static interpolation?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.estimators.frame.all_floors import without_free_vibration
from core.estimators.frame.calibration import Calibration
from core.estimators.frame.line_weights import LinearModel, channel_covariance
from core.estimators.frame.shape_error import roof_deformation
from core.estimators.frame.spectral_lines import Lines
from core.estimators.frame.superstructure_model import Design
from core.estimators.frame.unmodelled_motion import static_flexibility


@dataclass(frozen=True, slots=True)
class LeftOut:
    """How well floors between others are estimated, each from all channels but its own.

    Errors are 0 where no floor lies between others, or where noise alone explains the record.
    """

    model: float
    """Relative error by the calibrated superstructure."""
    static: float
    """Relative error by static interpolation (Guyan 1965)."""
    shape: float | None
    """Share of the roof's deformation that errors of shape have (see shape_error) to make the model's; None where no
    floor lies between others."""


def left_out(lines: Lines, design: Design, calibration: Calibration) -> LeftOut:
    """Errors of floors between others.

    Args:
        lines: that were calibrated by.
        design: of the building.
        calibration: of the superstructure.
    """
    inner = np.arange(1, design.measured.size)
    if inner.size == 0 or not calibration.hypothesis.is_random:
        return LeftOut(0.0, 0.0, None)
    spectra = without_free_vibration(lines, design, calibration.structure, calibration.parameters)
    covariance = channel_covariance(lines, design, calibration)
    told = LinearModel(lines, design, calibration, calibration.parameters, calibration.structure, 0.0)
    deformed = _power(roof_deformation(told, spectra))
    model, static, power, explained, allowed = 0.0, 0.0, 0.0, 0.0, 0.0
    for left in inner:
        others = np.delete(np.arange(len(spectra)), left)
        crossed = covariance[:, [left]][:, :, others]
        weights = np.linalg.solve(covariance[:, others][:, :, others].transpose(0, 2, 1), crossed.transpose(0, 2, 1))
        error = _power(spectra[left] - np.einsum("lo,ol->l", weights[:, :, 0], spectra[others]))
        seen = np.abs(weights[:, :, 0].T) ** 2
        explained += error - float(np.sum(lines.noise_at[left]) + np.sum(seen * lines.noise_at[others]))
        allowed += deformed * _beside_others(design, int(left), others)
        model += error
        static += _power(spectra[left] - _interpolation(design, int(left), others) @ spectra[others])
        power += _power(spectra[left])
    shape = float(np.sqrt(max(explained, 0.0) / allowed)) if allowed > 0 else None
    return LeftOut(float(np.sqrt(model / power)), float(np.sqrt(static / power)), shape)


def _interpolation(design: Design, left: int, others: np.ndarray) -> Vector:
    """Weights of the other channels, the base slab's among them, at a measured floor."""
    flexibility = static_flexibility(design)
    floors = design.measured[others[1:] - 1]
    seen = flexibility[np.ix_(floors, floors)]
    above = np.linalg.solve(seen, flexibility[floors, design.measured[left - 1]])
    return np.concatenate([[1 - above.sum()], above])


def _beside_others(design: Design, left: int, others: np.ndarray) -> float:
    """Variance of a floor's shape error beside the other sensors, over that of the roof's were it not measured."""
    flexibility, floors = static_flexibility(design), design.measured[others[1:] - 1]
    floor = design.measured[left - 1]
    to_others = flexibility[floors, floor]
    seen = flexibility[np.ix_(floors, floors)]
    return float(flexibility[floor, floor] - to_others @ np.linalg.solve(seen, to_others))


def _power(spectrum: np.ndarray) -> float:
    return float(np.sum(np.abs(spectrum) ** 2))
