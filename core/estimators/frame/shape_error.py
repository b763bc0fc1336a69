"""Error of the force where noise does not explain what a superstructure leaves of its record.

The modes' shapes are then wrong too, and floors without a sensor err by more than the sensors' noise. Measured floors
between others show by how much: each is estimated from all channels but its own, by the model and by static
interpolation. The model leaves a share r of the interpolation's error there. At the floors without a sensor it leaves
between r and all of its correction; the standard deviation is the geometric mean √r of the two times the force's
correction over static interpolation at each instant. Where no measured floor lies between others, errors are those of
uneven storeys: independent from storey to storey and zero at the sensors.
"""

import numpy as np
from scipy import signal

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.estimators.frame.line_misfit import responses
from core.estimators.frame.line_weights import LinearModel, channel_responses
from core.estimators.frame.unmodelled_motion import static_flexibility

SHARE = 0.1
"""Of the roof's motion relative to the base slab: standard deviation of the roof's shape error were it not measured.

It holds where no floor lies between others, so that the record does not show it. Chosen by the first of the real
building's three records; the other two and the simulated ones had no part in it."""
ENVELOPE = 2.0
"""s, over which the motion's strength is judged."""


def shape_error(model: LinearModel, spectra: ComplexMatrix, force: ComplexVector, share: float | None) -> Vector:
    """(n,) N, effect of one standard deviation on the force; 0 for a superstructure that explains its record.

    Args:
        model: of the record, at all of its lines.
        spectra: (channels, lines) without free vibration.
        force: (lines,) N, spectrum of the force by the model.
        share: of the interpolation's error at left-out floors that the model leaves; None where the record does not
            show it.
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
    """(n,) of the sum of (k, n) histories, over ENVELOPE about each instant."""
    window = signal.windows.hann(max(3, round(ENVELOPE * rate)))
    strength = signal.fftconvolve((histories**2).sum(axis=0), window / window.sum(), mode="same")
    return np.asarray(np.maximum(strength, 0.0))


def _interpolated_force(model: LinearModel) -> ComplexVector:
    """(lines,) N, of floors that static interpolation (Guyan 1965) puts between those measured."""
    base, floors = model.lines.spectra[0], model.lines.spectra[1:]
    carried = model.structure.mass @ _to_sensors(model)
    total = model.base_mass + model.structure.mass.sum()
    return np.asarray(-total * base - carried @ (floors - base))


def _to_sensors(model: LinearModel) -> Matrix:
    """(floors, measured) static interpolation."""
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
