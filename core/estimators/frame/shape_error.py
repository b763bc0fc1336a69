"""Error of the force where noise does not explain what a superstructure leaves of its record.

The modes' shapes are then wrong too, and floors without a sensor err by more than the sensors' noise. Measured floors
between others show by how much: each is estimated from all channels but its own, by the model and by static
interpolation. Beyond the sensors' noise the model leaves a share r of the interpolation's error there. At the floors
without a sensor it leaves between r and all of its correction; the standard deviation is the geometric mean √r of the
two times the force's correction over static interpolation at each instant. Where no measured floor lies between
others, errors are those of uneven storeys: independent from storey to storey and zero at the sensors.
"""

from dataclasses import dataclass

import numpy as np
import scipy

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.estimators.frame.calibration import Calibration
from core.estimators.frame.likelihood import responses, static_flexibility
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Design
from core.estimators.frame.reconstruction import (
    LinearModel,
    channel_covariance,
    channel_responses,
    without_free_vibration,
)

SHARE = 0.1
"""Standard deviation of an unmeasured roof's shape error over its motion relative to the base slab.

It applies where no measured floor lies between others. Chosen by the first of the real
building's three records; the other two and the simulated ones had no part in it."""
ENVELOPE = 2.0
"""s, window of local mean squares. A choice."""


def shape_error(model: LinearModel, spectra: ComplexMatrix, force: ComplexVector, share: float | None) -> Vector:
    """(n,) N, one standard deviation of the force's error; 0 for a superstructure that explains its record.

    Args:
        model: of the record, at all of its lines.
        spectra: (channels, lines) without free vibration.
        force: (lines,) N, spectrum of the force by the model.
        share: LeftOut.share.
    """
    lines = model.lines
    if not model.calibration.hypothesis.is_random:
        return np.zeros(lines.samples)
    if share is None:
        error = SHARE * _inertia_beside_sensors(model) * _roof_deformation(model, spectra)
    else:
        error = np.sqrt(share) * (force - _interpolated_force(model))
    return np.asarray(np.fft.irfft(error, lines.samples))


def local_mean_square(histories: np.ndarray, rate: float) -> Vector:
    """(n,) mean over ENVELOPE about each instant of the sum of squares of (k, n) histories."""
    window = scipy.signal.windows.hann(max(3, round(ENVELOPE * rate)))
    strength = scipy.signal.fftconvolve((histories**2).sum(axis=0), window / window.sum(), mode="same")
    return np.asarray(np.maximum(strength, 0.0))


def _interpolated_force(model: LinearModel) -> ComplexVector:
    """(lines,) N, force by static interpolation (Guyan 1965) between the measured floors."""
    base, floors = model.lines.spectra[0], model.lines.spectra[1:]
    carried = model.structure.mass @ _to_sensors(model)
    total = model.base_mass + model.structure.mass.sum()
    return np.asarray(-total * base - carried @ (floors - base))


def _to_sensors(model: LinearModel) -> Matrix:
    """(floors, measured) weights of static interpolation."""
    flexibility, measured = static_flexibility(model.design), model.design.measured
    return np.asarray(np.linalg.solve(flexibility[np.ix_(measured, measured)], flexibility[measured]).T)


def _inertia_beside_sensors(model: LinearModel) -> float:
    """kg, standard deviation of the force over that of the roof's acceleration, no floor moving at the sensors."""
    flexibility, mass = static_flexibility(model.design), model.structure.mass
    beside = flexibility - _to_sensors(model) @ flexibility[model.design.measured]
    return float(np.sqrt(np.maximum(mass @ beside @ mass, 0.0)))


def _roof_deformation(model: LinearModel, spectra: ComplexMatrix) -> ComplexVector:
    """(lines,) m/s², acceleration of the roof relative to the base slab, the channels weighed by their noise."""
    lines = model.lines
    seen = channel_responses(model).base
    amplitude = np.sum(seen.conj() * spectra / lines.noise_at, axis=0) / np.sum(
        np.abs(seen) ** 2 / lines.noise_at, axis=0
    )
    roof = np.array([model.design.floor_mass.size - 1])
    alone = responses(model.structure, lines.angular, roof, np.ones((2, lines.angular.size), dtype=complex), 1)
    return np.asarray((alone.base[1] - alone.base[0]) * amplitude)


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Relative errors of left-out floors; 0 where no floor lies between others, or where noise explains the record."""

    model: float
    """By the calibrated superstructure."""
    static: float
    """By static interpolation (Guyan 1965)."""
    share: float | None
    """Share of the interpolation's error that the model leaves, both beyond noise; None where no floor is left out."""


def left_out(lines: Lines, design: Design, calibration: Calibration) -> LeftOut:
    """Errors of floors between others.

    Args:
        lines: those of the calibration.
        design: of the building.
        calibration: of the superstructure.
    """
    inner = np.arange(1, design.measured.size)
    if inner.size == 0 or not calibration.hypothesis.is_random:
        return LeftOut(0.0, 0.0, None)
    spectra = without_free_vibration(lines, design, calibration.structure, calibration.parameters)
    covariance = channel_covariance(lines, design, calibration)
    model, static, power = 0.0, 0.0, 0.0
    model_noise, static_noise = 0.0, 0.0
    each = lines.noise_at.sum(axis=1)
    for left in inner:
        others = np.delete(np.arange(len(spectra)), left)
        crossed = covariance[:, [left]][:, :, others]
        weights = np.linalg.solve(covariance[:, others][:, :, others].transpose(0, 2, 1), crossed.transpose(0, 2, 1))
        by_others, between = weights[:, :, 0], _interpolation(design, int(left), others)
        model += _power(spectra[left] - np.einsum("lo,ol->l", by_others, spectra[others]))
        static += _power(spectra[left] - between @ spectra[others])
        power += _power(spectra[left])
        model_noise += float(each[left] + np.sum(np.abs(by_others.T) ** 2 * lines.noise_at[others]))
        static_noise += float(each[left] + between**2 @ each[others])
    beyond = max(model - model_noise, 0.0), static - static_noise
    share = float(np.sqrt(min(beyond[0] / beyond[1], 1.0))) if beyond[1] > 0 else 0.0
    return LeftOut(float(np.sqrt(model / power)), float(np.sqrt(static / power)), share)


def _interpolation(design: Design, left: int, others: np.ndarray) -> Vector:
    """Weights of the other channels, the base slab's among them, at a measured floor."""
    flexibility = static_flexibility(design)
    floors = design.measured[others[1:] - 1]
    seen = flexibility[np.ix_(floors, floors)]
    above = np.linalg.solve(seen, flexibility[floors, design.measured[left - 1]])
    return np.concatenate([[1 - above.sum()], above])


def _power(spectrum: np.ndarray) -> float:
    return float(np.sum(np.abs(spectrum) ** 2))
