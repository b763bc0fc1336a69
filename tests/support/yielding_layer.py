"""A layer that yields, and comes to lie elsewhere while it moves."""

import numpy as np

from core.arrays import Vector

RATE, COUNT = 100.0, 13000
STIFFNESS, DAMPING, STRENGTH, ELASTIC = 2.0, 0.1, 0.5, 40.0
"""1/s², 1/s, m/s² and 1/s², all over the mass: of a spring, a dashpot, and a slider with a spring of its own."""
STEPS = 4
"""Steps of the integration in a sample."""


def yielding_layer(seed: int, later: float) -> tuple[Vector, Vector, Vector]:
    """(COUNT,) m, m/s² and m/s², displacement, relative acceleration and the ground's, with the noise of sensors.

    The ground shakes from 10 s to 50 s, and with the share `later` of that up to 100 s.
    """
    rng = np.random.default_rng(seed)
    f, time = np.fft.rfftfreq(COUNT, 1 / RATE), np.arange(COUNT) / RATE
    waves = np.fft.irfft(np.fft.rfft(rng.standard_normal(COUNT)) * f**2 / (f**2 + 0.04) / (1 + f**4), COUNT)
    ground = waves * np.select([time < 10, time < 50, time < 100], [0.0, 1.0, later], 0.0)
    ground *= 2.5 / np.abs(ground).max()
    u = v = slider = 0.0
    moved, relative = np.empty(COUNT), np.empty(COUNT)
    for sample in range(COUNT):
        for _ in range(STEPS):
            acceleration = -(STIFFNESS * u + DAMPING * v + slider) - ground[sample]
            v += acceleration / RATE / STEPS
            u += v / RATE / STEPS
            slider = min(STRENGTH, max(-STRENGTH, slider + ELASTIC * v / RATE / STEPS))
        moved[sample], relative[sample] = u, acceleration
    noise = rng.standard_normal((3, COUNT)) * [[1e-5], [0.005], [0.003]]
    return moved + noise[0], relative + noise[1], ground + noise[2]
