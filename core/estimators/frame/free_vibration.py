"""Free vibration in a record that does not begin and end at rest, in addition to the response that its transform
assumes.

The discrete Fourier transform takes a record for one period of a periodic motion. From that, what happened differs by a
free vibration of the modes from the first sample on (Pintelon and Schoukens 2012, section 6.3.2).
"""

import numpy as np

from core.arrays import ComplexMatrix, ComplexTensor, ComplexVector, Indices, Vector
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Superstructure

LARGEST_RATIO = 0.9
"""Largest damping ratio; a calibration may try larger ones, which mean no vibration. A choice."""


def free_vibration(structure: Superstructure, angular: Vector, samples: int, rate: float) -> ComplexTensor:
    """Spectra of the modes' free vibration from the record's first sample on.

    Args:
        structure: whose modes.
        angular: (lines,) rad/s.
        samples: n, of the record.
        rate: Hz.

    Returns:
        (modes, 2, lines) of the real and the imaginary part of exp(s t).
    """
    poles, instant = _poles(structure), np.exp(-1j * angular / rate)
    forward = _decay_spectrum(poles, instant, samples, rate)
    backward = _decay_spectrum(poles.conj(), instant, samples, rate)
    return np.stack([(forward + backward) / 2, (forward - backward) / 2j], axis=1)


def free_vibration_columns(structure: Superstructure, lines: Lines, floors: Indices) -> ComplexTensor:
    """(2 modes, floors, lines) spectra at the given floors of each mode's free vibration, real and imaginary part."""
    vibration = free_vibration(structure, lines.angular, lines.samples, lines.rate)
    columns = structure.shapes[floors].T[:, None, :, None] * vibration[:, :, None, :]
    return np.asarray(columns.reshape(-1, floors.size, lines.angular.size))


def floors_free_vibration(
    structure: Superstructure, lines: Lines, floors: Indices, amplitudes: Vector
) -> ComplexMatrix:
    """(floors, lines) spectra at the given floors; 0 of a record that begins and ends at rest.

    Args:
        structure: whose modes.
        lines: of the record.
        floors: which.
        amplitudes: (2 modes,) m/s² kg^½, of the real and the imaginary part of every mode.
    """
    if lines.at_rest:
        return np.zeros((floors.size, lines.angular.size), dtype=complex)
    vibration = free_vibration(structure, lines.angular, lines.samples, lines.rate)
    by_mode = np.sum(amplitudes.reshape(-1, 2, 1) * vibration, axis=1)
    return np.asarray(structure.shapes[floors] @ by_mode)


def free_vibration_changes(
    structure: Superstructure, lines: Lines, floors: Indices, amplitudes: Vector
) -> ComplexTensor:
    """(structural, floors, lines) derivatives of `floors_free_vibration` by the structure's parameters.

    Args: as of `floors_free_vibration`.
    """
    _, by_shapes, _ = structure.changes
    vibration = free_vibration(structure, lines.angular, lines.samples, lines.rate)
    by_mode = np.sum(amplitudes.reshape(-1, 2, 1) * vibration, axis=1)
    by_poles, moved = pole_changes(structure), vibration_changes(structure, lines, amplitudes)
    seen = structure.shapes[floors]
    by_real, by_imaginary = (seen * part[:, None] for part in (by_poles.real, by_poles.imag))
    return np.asarray(by_real @ moved[:, 0] + by_imaginary @ moved[:, 1] + by_shapes[:, floors] @ by_mode)


def vibration_changes(structure: Superstructure, lines: Lines, amplitudes: Vector) -> ComplexTensor:
    """(modes, 2, lines) derivatives of each mode's free vibration by the real and the imaginary part of its pole.

    Args:
        structure: whose modes.
        lines: of the record.
        amplitudes: (2 modes,) m/s² kg^½, of the real and the imaginary part of every mode.
    """
    poles, instant = _poles(structure), np.exp(-1j * lines.angular / lines.rate)
    amplitude = (amplitudes[0::2] - 1j * amplitudes[1::2])[:, None] / 2
    forward = amplitude * _decay_derivative(poles, instant, lines.samples, lines.rate)
    backward = amplitude.conj() * _decay_derivative(poles.conj(), instant, lines.samples, lines.rate)
    return np.stack([forward + backward, 1j * (forward - backward)], axis=1)


def pole_changes(structure: Superstructure) -> ComplexMatrix:
    """(structural, modes) derivatives of the modes' poles by the structure's parameters."""
    by_squared, _, by_ratios = structure.changes
    ω, ζ = np.sqrt(structure.squared), structure.damping_ratios
    root = np.sqrt(1 - np.minimum(ζ, LARGEST_RATIO) ** 2)
    turning = np.where(ζ < LARGEST_RATIO, ω * (-1 - 1j * np.minimum(ζ, LARGEST_RATIO) / root), 0.0)
    return np.asarray(_poles(structure) * by_squared / (2 * structure.squared) + turning * by_ratios)


def _poles(structure: Superstructure) -> ComplexVector:
    ω, ζ = np.sqrt(structure.squared), np.minimum(structure.damping_ratios, LARGEST_RATIO)
    return np.asarray((-ζ + 1j * np.sqrt(1 - ζ**2)) * ω)


def _decay_spectrum(poles: ComplexVector, instant: ComplexVector, samples: int, rate: float) -> ComplexMatrix:
    whole = 1 - np.exp(poles[:, None] * samples / rate)
    return np.asarray(whole / (1 - np.exp(poles[:, None] / rate) * instant))


def _decay_derivative(poles: ComplexVector, instant: ComplexVector, samples: int, rate: float) -> ComplexMatrix:
    """(modes, lines) of `_decay_spectrum` by the poles."""
    end, step = np.exp(poles[:, None] * samples / rate), np.exp(poles[:, None] / rate) * instant
    return np.asarray((-samples / rate * end + (1 - end) * step / rate / (1 - step)) / (1 - step))
