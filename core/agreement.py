"""Does a channel move as it should where the building moves as one body?"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector, Matrix, Vector
from core.clock import BAND
from core.noise import noise_std
from core.record import Channel

CLEAR = 100.0
"""Power of a channel over that of its noise in the band, below which nothing is concluded from it."""
COHERENT = 0.8
"""Squared coherence of two levels of one rigid body; healthy buildings have 0.98 and more."""
GAIN = 2.0
"""Factor between two levels; quasi-static deflection makes 1.2 of it on a real five-storey building."""


Booleans = np.ndarray[tuple[int], np.dtype[np.bool_]]


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong with a channel."""

    kind: str
    channel: Channel
    value: float
    message: str


def low_spectra(samples: Matrix, rate: float) -> tuple[Vector, ComplexMatrix, Booleans]:
    """Spectra of channels where the building moves as one body.

    Args:
        samples: (channels, n).
        rate: Hz.

    Returns:
        (frequencies,) Hz, (channels, frequencies), and (channels,) whether each is clear above its noise.

    Raises:
        RecordError: the record is too short to know its noise.
    """
    noise = noise_std(samples, rate)
    window = np.hanning(samples.shape[1])
    frequency: Vector = np.asarray(np.fft.rfftfreq(window.size, 1 / rate), dtype=float)
    within = (frequency >= BAND[0]) & (frequency <= BAND[1])
    values = np.fft.rfft(samples * window, axis=1)[:, within]
    clear = np.sum(np.abs(values) ** 2, axis=1) > CLEAR * within.sum() * np.sum(window**2) * noise**2
    return np.asarray(frequency[within]), values, clear


def against(channel: Channel, motion: ComplexVector, expected: ComplexVector, name: str) -> Iterator[Fault]:
    """What is wrong with a channel that should move nearly as expected.

    Args:
        channel: which one.
        motion: (frequencies,) its spectrum.
        expected: (frequencies,) that of the motion it should have.
        name: whose motion that is, for messages.
    """
    cross = np.vdot(expected, motion)
    power, own = np.vdot(expected, expected).real, np.vdot(motion, motion).real
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
