"""How far may floors without a sensor be from where a superstructure that does not explain its record puts them?

The modes' shapes are then wrong too, by some share of the motion. Such errors are taken to be those that uneven
storeys make: independent from storey to storey, in proportion to the storey's flexibility, and none at the sensors. So
they grow with the distance from the nearest sensor, and with the building's deformation at the moment.
"""

import numpy as np
from scipy import signal

from core.arrays import ComplexMatrix, ComplexVector, Vector
from core.estimators.frame.line_misfit import responses
from core.estimators.frame.line_weights import LinearModel, channel_responses
from core.estimators.frame.unmodelled_motion import static_flexibility

SHARE = 0.1
"""Of the roof's motion relative to the base slab: standard deviation of the roof's shape error were it not measured.

It holds where no floor lies between others, so that the record does not show it. Chosen by the first of the real
building's three records; the other two and the simulated ones had no part in it."""
UNSEEN = 2.0
"""Standard deviation of shape errors at floors without a sensor over that at left-out floors, which are one or two."""
ENVELOPE = 2.0
"""s, over which the motion's strength is judged."""


def shape_error(model: LinearModel, spectra: ComplexMatrix, shape: float | None) -> Vector:
    """(n,) N, effect of one standard deviation on the force; 0 for a superstructure that explains its record.

    Args:
        model: of the record, at all of its lines.
        spectra: (channels, lines) without free vibration.
        shape: share of the roof's deformation that the errors of left-out floors ask for; None where the record does
            not show it, for SHARE.
    """
    lines = model.lines
    if not model.calibration.hypothesis.is_random:
        return np.zeros(lines.samples)
    share = SHARE if shape is None else UNSEEN * shape
    deformed = share * _inertia_beside_sensors(model) * roof_deformation(model, spectra)
    return np.asarray(np.fft.irfft(deformed, lines.samples))


def local_mean_square(histories: np.ndarray, rate: float) -> Vector:
    """(n,) of the sum of (k, n) histories, over ENVELOPE about each instant."""
    window = signal.windows.hann(max(3, round(ENVELOPE * rate)))
    strength = signal.fftconvolve((histories**2).sum(axis=0), window / window.sum(), mode="same")
    return np.asarray(np.maximum(strength, 0.0))


def _inertia_beside_sensors(model: LinearModel) -> float:
    """kg, standard deviation of the force over that of the roof's acceleration, no floor moving at the sensors."""
    flexibility, measured = static_flexibility(model.design), model.design.measured
    mass = model.structure.mass
    to_sensors = flexibility[:, measured]
    beside = flexibility - to_sensors @ np.linalg.solve(flexibility[np.ix_(measured, measured)], to_sensors.T)
    return float(np.sqrt(np.maximum(mass @ beside @ mass, 0.0)))


def roof_deformation(model: LinearModel, spectra: ComplexMatrix) -> ComplexVector:
    """(lines,) m/s², acceleration of the roof relative to the base slab, the channels weighed by their noise."""
    lines = model.lines
    seen = channel_responses(model).base
    amplitude = np.sum(seen.conj() * spectra / lines.noise_at, axis=0) / np.sum(
        np.abs(seen) ** 2 / lines.noise_at, axis=0
    )
    roof = np.array([model.design.floor_mass.size - 1])
    alone = responses(model.structure, lines.angular, roof, np.ones((2, lines.angular.size), dtype=complex), 1)
    return np.asarray((alone.base[1] - alone.base[0]) * amplitude)
