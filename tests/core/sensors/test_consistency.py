"""A floor's quasi-static deflection, and a layer that hardly moves, are no faults of sensors."""

import numpy as np
import pytest
from described import BASE, GROUND, LAYER, ROOF, START, paper

from core.arrays import Vector
from core.record import Record
from core.sensors.consistency import disagreements

RATE, COUNT = 100.0, 6000
FREQUENCY = np.fft.rfftfreq(COUNT, 1 / RATE)
ω = 2 * np.pi * FREQUENCY


def motion(rng: np.random.Generator, centre: float) -> Vector:
    """(COUNT,) m/s², broad about a frequency in Hz, of standard deviation 1, fading at both ends."""
    spectrum = np.fft.rfft(rng.standard_normal(COUNT)) * np.exp(-((np.log(np.maximum(FREQUENCY, 0.01) / centre)) ** 2))
    history = np.fft.irfft(spectrum, COUNT) * np.hanning(COUNT)
    return np.asarray(history / history.std())


def roof(base: Vector, first: float) -> Vector:
    """That of a superstructure of one mode, 2 % damped."""
    ω_1 = 2 * np.pi * first
    transfer = 1 + 1.27 * ω**2 / (ω_1**2 - ω**2 + 2j * 0.02 * ω * ω_1)
    return np.fft.irfft(np.fft.rfft(base) * transfer, COUNT)


def displacement(relative: Vector) -> Vector:
    """(COUNT,) m, above 0.1 Hz."""
    factor = np.where(FREQUENCY > 0.1, -1 / np.maximum(ω, 0.1) ** 2, 0)
    return np.fft.irfft(np.fft.rfft(relative) * factor, COUNT)


def found(samples: dict[str, Vector]) -> list[tuple[str, str | None]]:
    channels = tuple(channel for channel in paper().channels if channel.id in samples)
    record = Record(START, RATE, channels, np.array([samples[channel.id] for channel in channels]))
    return [(finding.kind, finding.channel) for finding in disagreements(record, paper())]


@pytest.mark.parametrize("first", [1.05, 1.3, 2.0])
@pytest.mark.parametrize("gain", [1.0, 0.1, 10.0])
def test_deflection_below_the_first_frequency_is_no_gain(first: float, gain: float) -> None:
    """At 0.65 Hz and a first frequency of 1.05 Hz the roof moves 1.8 times as much as the base slab."""
    rng = np.random.default_rng(1)
    base = motion(rng, 0.65)
    samples = {BASE: base, ROOF: gain * roof(base, first)}
    assert found(samples) == ([] if gain == 1 else [("unit", ROOF)])


@pytest.mark.parametrize("moved", [0.02, 1.0])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_layer_that_moves_less_than_its_sides_noise_is_not_judged(moved: float, sign: float) -> None:
    """At 2 % of its sides' motion what they say of the layer is their noise of 3 %."""
    rng = np.random.default_rng(2)
    ground, relative = motion(rng, 0.5), moved * motion(rng, 0.5)
    noise = 0.03 * rng.standard_normal((2, COUNT))
    layer = sign * displacement(relative)
    samples = {GROUND: ground + noise[0], BASE: ground + relative + noise[1], LAYER: layer}
    assert found(samples) == ([("reversed", LAYER)] if sign < 0 and moved == 1 else [])
