"""An estimator that tells all floors together from those measured, by a superstructure calibrated from the record."""

import numpy as np

from core import cms
from core.arrays import Vector
from core.calibration import Lines
from core.estimator import InstrumentedSuperstructure, RestoringForce
from core.hypotheses import Choice, chosen
from core.noise import noise_density
from core.smoothing import smoothed
from core.superstructure_model import Design

NAME = "smoother"
CALIBRATED = (0.2, 20.0)
"""Hz, of the lines that the superstructure is calibrated by."""
BANDS = np.geomspace(0.3, 25.0, 16)
"""Hz, between the bands in which unmodelled motion is of one strength."""
AT_REST = 0.02
"""Of the channels' largest root mean square over half a second: less at either end is rest."""
EDGE = 0.5
"""s, of the record at either end."""
RINGING = 3.0
"""Of the floors' root mean square: how large the free vibration at the record's ends may be."""


def estimate(superstructure: InstrumentedSuperstructure) -> RestoringForce:
    """Restoring force F = -Σ m_i a_i with all floors' accelerations estimated together from the measured ones."""
    design = Design.of(superstructure.floor_mass, superstructure.storey_stiffness, superstructure.measured)
    lines = spectral_lines(superstructure)
    transient = 0.0 if lines.at_rest else RINGING * float(
        np.std(superstructure.floor_acceleration) * np.sqrt(superstructure.floor_mass.sum())
    )
    used = within(lines, CALIBRATED)
    choice = chosen(used, design, transient)
    return _force(superstructure, lines, design, choice)


def _force(superstructure: InstrumentedSuperstructure, lines: Lines, design: Design, choice: Choice) -> RestoringForce:
    bands = choice.lines.band
    whole = Lines(
        lines.angular, lines.spectra, choice.lines.noise, np.clip(lines.band, bands.min(), bands.max()),
        lines.samples, lines.rate, lines.at_rest,
    )  # fmt: skip
    found = smoothed(whole, design, choice.calibration, superstructure.base_mass)
    return RestoringForce(NAME, found.force, found.rigid, found.force - found.rigid, found.std, ())


def spectral_lines(superstructure: InstrumentedSuperstructure) -> Lines:
    """All of the record's spectrum."""
    series = np.vstack([superstructure.base_acceleration, superstructure.floor_acceleration])
    samples, rate = series.shape[1], superstructure.rate
    frequency = np.fft.rfftfreq(samples, 1 / rate)
    angular = 2 * np.pi * frequency
    angular[0] = 1e-3 * angular[1]
    noise = noise_density(series, rate) * samples * rate / 2
    spectra = np.fft.rfft(series, axis=1)
    return Lines(angular, spectra, noise, np.digitize(frequency, BANDS), samples, rate, _is_at_rest(series, rate))


def within(lines: Lines, band: tuple[float, float]) -> Lines:
    """The lines of a band of frequencies."""
    chosen_lines = (lines.angular > 2 * np.pi * band[0]) & (lines.angular < 2 * np.pi * band[1])
    return Lines(
        lines.angular[chosen_lines], lines.spectra[:, chosen_lines], lines.noise, lines.band[chosen_lines],
        lines.samples, lines.rate, lines.at_rest,
    )  # fmt: skip


def _is_at_rest(series: np.ndarray, rate: float) -> bool:
    window = max(1, round(EDGE * rate))
    energy = np.array([np.convolve(row**2, np.ones(window) / window, mode="valid") for row in series])
    ends = np.maximum(energy[:, 0], energy[:, -1])
    quiet = np.quantile(energy, 0.02, axis=1)
    return bool(np.all(ends - quiet < AT_REST**2 * energy.max(axis=1)))
