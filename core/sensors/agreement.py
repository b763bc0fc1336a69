"""Does a channel move as it should where the building moves as one body?"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.record import Channel, Quantity
from core.sensors.clock import BAND
from core.signals.noise import noise_std

CLEAR = 100.0
"""Power of a channel over that of its noise in the band, below which nothing is concluded from it."""
COHERENT = 0.8
"""Squared coherence of two levels of one rigid body; healthy buildings have 0.98 and more."""
GAIN = 2.0
"""Factor between two levels, beyond their quasi-static deflection."""
TOLD = 3.0
"""Power of the motion expected over that of its noise, below which nothing is concluded from it."""


Booleans = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong with a channel."""

    kind: str
    channel: Channel
    value: float
    message: str


@dataclass(frozen=True, slots=True, eq=False)
class LowSpectra:
    """Channels where the building moves as one body."""

    frequency: Vector
    """(frequencies,) Hz."""
    values: ComplexMatrix
    """(channels, frequencies)."""
    noise: Matrix
    """(channels, frequencies) power that noise alone is expected to have."""
    clear: Booleans
    """(channels,) whether each is clear above its noise."""

    def accelerations(self, quantities: Sequence[Quantity]) -> "LowSpectra":
        """The same with displacements differentiated twice.

        Args:
            quantities: (channels,) what each measures.
        """
        twice = -((2 * np.pi * self.frequency) ** 2)
        factor = np.array([twice if quantity == "displacement" else np.ones_like(twice) for quantity in quantities])
        return replace(self, values=self.values * factor, noise=self.noise * factor**2)


def low_spectra(samples: Matrix, rate: float) -> LowSpectra:
    """Spectra of channels where the building moves as one body.

    Args:
        samples: (channels, n).
        rate: Hz.

    Raises:
        RecordError: the record is too short to know its noise.
    """
    window = np.hanning(samples.shape[1])
    frequency: Vector = np.asarray(np.fft.rfftfreq(window.size, 1 / rate), dtype=float)
    within = (frequency >= BAND[0]) & (frequency <= BAND[1])
    values = np.fft.rfft(samples * window, axis=1)[:, within]
    noise = np.outer(noise_std(samples, rate) ** 2, np.full(within.sum(), np.sum(window**2)))
    clear = np.sum(np.abs(values) ** 2, axis=1) > CLEAR * noise.sum(axis=1)
    return LowSpectra(np.asarray(frequency[within]), values, noise, clear)


def against(
    channel: Channel, motion: ComplexVector, expected: ComplexVector, name: str, noise: float = 0.0
) -> Iterator[Fault]:
    """What is wrong with a channel that should move nearly as expected.

    Args:
        channel: which one.
        motion: (frequencies,) its spectrum.
        expected: (frequencies,) that of the motion it should have.
        name: whose motion that is, for messages.
        noise: of the power of what is expected, what is only its noise; if that is too much nothing is concluded.
    """
    cross = np.vdot(expected, motion)
    power, own = np.vdot(expected, expected).real - noise, np.vdot(motion, motion).real
    if power < TOLD * noise:
        return
    coherence, gain = abs(cross) ** 2 / (power * own), float(cross.real / power)
    if coherence < COHERENT:
        message = f"does not move with {name} below {BAND[1]} Hz (squared coherence {coherence:.2f}): check the sensor"
        yield Fault("incoherent", channel, float(coherence), f"{message}. It is left out")
    elif gain < 0:
        message = f"moves opposite to {name}: its polarity is reversed. Turn its sign and analyse again"
        yield Fault("reversed", channel, gain, message)
    elif not 1 / GAIN < gain < GAIN:
        message = (
            f"moves {gain:.3g} times as much as {name} below {BAND[1]} Hz: check its unit and gain. It is left out"
        )
        yield Fault("unit", channel, gain, message)
