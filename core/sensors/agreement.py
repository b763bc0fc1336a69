"""Comparison of a channel with the motion expected where the building moves as one body."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import ComplexMatrix, ComplexVector, Mask, Matrix, Vector
from core.description import BuildingDescription
from core.record import Channel, Finding, Quantity
from core.sensors.clock import BAND
from core.sensors.screening import loss
from core.signals.noise import noise_std
from core.signals.spectra import hann_spectra

CLEAR = 100.0
"""Power of a channel over that of its noise in the band, below which it is not judged. A choice: a signal ten times the
noise."""
COHERENT = 0.8
"""Least squared coherence of two levels of one rigid body; healthy buildings have 0.98 and more. A choice."""
GAIN = 2.0
"""Largest factor between two levels, beyond their quasi-static deflection. A choice: units err by ten and more."""
LEAST_EXPECTED = 3.0
"""Power of the expected motion over that of its noise, below which the channel is not judged. Not tuned."""
LEFT_OUT = "The channel is left out"
"""Consequences of some faults, in words."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Fault of a channel."""

    kind: str
    channel: Channel
    value: float
    message: str

    def finding(self, description: BuildingDescription) -> Finding:
        """The fault as a finding, with the severity of losing the channel."""
        return Finding(self.kind, loss(self.channel, description), self.message, self.channel.id, self.value)


@dataclass(frozen=True, slots=True, eq=False)
class LowSpectra:
    """Spectra of channels where the building moves as one body."""

    frequency: Vector
    """(frequencies,) Hz."""
    values: ComplexMatrix
    """(channels, frequencies)."""
    noise: Matrix
    """(channels, frequencies) expected power of the noise alone."""
    clear: Mask
    """(channels,) True for channels that are clear above their noise."""

    def accelerations(self, quantities: Sequence[Quantity]) -> "LowSpectra":
        """The spectra with displacements differentiated twice.

        Args:
            quantities: (channels,) measured quantity of each.
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
        RecordError: the record is shorter than 10 s, too short to estimate its noise.
    """
    spectra = hann_spectra(samples, rate, BAND)
    noise = np.outer(noise_std(samples, rate) ** 2, np.full(spectra.frequency.size, spectra.window_power))
    clear = np.sum(np.abs(spectra.values) ** 2, axis=1) > CLEAR * noise.sum(axis=1)
    return LowSpectra(spectra.frequency, spectra.values, noise, clear)


def against(
    channel: Channel,
    motion: ComplexVector,
    expected: ComplexVector,
    name: str,
    *,
    noise: float = 0.0,
    below: float = BAND[1],
) -> Iterator[Fault]:
    """Fault of a channel that should move nearly as expected, if it has one.

    Args:
        channel: its description.
        motion: (frequencies,) its spectrum.
        expected: (frequencies,) spectrum of the motion that it should have.
        name: of the expected motion, for messages.
        noise: power of the noise in the expected motion; if that is too much, the channel is not judged.
        below: Hz, highest frequency, for messages.
    """
    cross = np.vdot(expected, motion)
    power, own = np.vdot(expected, expected).real - noise, np.vdot(motion, motion).real
    if power < LEAST_EXPECTED * noise:
        return
    coherence, gain = abs(cross) ** 2 / (power * own), float(cross.real / power)
    if coherence < COHERENT:
        message = (
            f"does not move with {name} below {below:.2g} Hz (squared coherence {coherence:.2f}): check the sensor"
        )
        yield Fault("incoherent", channel, float(coherence), f"{message}. {LEFT_OUT}")
    elif gain < 0:
        message = f"moves opposite to {name}: its polarity is reversed. Reverse its sign and analyse again"
        yield Fault("reversed", channel, gain, message)
    elif not 1 / GAIN < gain < GAIN:
        message = f"moves {gain:.3g} times as much as {name} below {below:.2g} Hz: check its unit and gain"
        yield Fault("unit", channel, gain, f"{message}. {LEFT_OUT}")
