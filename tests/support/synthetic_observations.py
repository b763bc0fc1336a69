"""Observations of a layer with a prescribed motion, known force, and known noise."""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

import numpy as np

from core.arrays import Vector
from core.estimators.result import white
from core.fitting.observation import LayerHistory, Observation
from core.model.force_response import force_response
from core.model.isolator import Conditions, Isolator, carried
from core.signals.whitening import BAND, whitening

RATE = 100.0
REFERENCE = datetime(2021, 3, 4, tzinfo=UTC)
PEAKS = (0.01, 0.08, 0.03)  # m
SECONDS = 30.0

BOUC_WEN = Isolator(
    {
        "elastic": {"k_b": 475e6},
        "viscous": {"c_b": 6e6},
        "bouc_wen": {"F_y": 2e6, "D_y": 4e-3, "A": 1.0, "beta": 0.5, "gamma": 0.5, "n": 1.0},
    }
)


def motion(peak: float, rng: np.random.Generator, seconds: float = SECONDS) -> tuple[Vector, Vector]:
    """Displacement (m) and velocity (m/s) of twelve sines between 0.2 and 2 Hz that grow and die away."""
    t = np.arange(0.0, seconds, 1 / RATE)
    envelope, growth = np.sin(np.pi * t / seconds) ** 2, np.pi / seconds * np.sin(2 * np.pi * t / seconds)
    u, v = np.zeros(t.size), np.zeros(t.size)
    for omega, phase in zip(2 * np.pi * rng.uniform(0.2, 2.0, 12), rng.uniform(0, 2 * np.pi, 12), strict=True):
        u += envelope * np.sin(omega * t + phase) / omega
        v += growth * np.sin(omega * t + phase) / omega + envelope * np.cos(omega * t + phase)
    scale = peak / np.abs(u).max()
    return scale * u, scale * v


def observations(
    truth: Isolator, noise: float, seed: int, peaks: Sequence[float] = PEAKS, seconds: float = SECONDS
) -> tuple[Observation, ...]:
    """One a month, from March 2021 on; noise that is white within the band, over each force's root mean square."""
    rng, made, states = np.random.default_rng(seed), [], None
    for number, peak in enumerate(peaks):
        one, last = _observation(truth, noise, rng, number, peak, seconds, states)
        made.append(one)
        states = carried(truth, last)
    return tuple(made)


def _observation(
    truth: Isolator,
    noise: float,
    rng: np.random.Generator,
    number: int,
    peak: float,
    seconds: float,
    states: Vector | None,
) -> tuple[Observation, Vector]:
    """The observation, and the layer's states at its end."""
    u, v = motion(peak, rng, seconds)
    start = REFERENCE + timedelta(days=30 * number)
    across, across_rate = motion(0.7 * peak, rng, seconds)
    conditions = Conditions(
        u_cross=across,
        v_cross=across_rate,
        axial_load=1 + 0.1 * rng.standard_normal(u.size),
        temperature=np.full(u.size, 10.0 + 10.0 * number),
        time=(start - REFERENCE).total_seconds() + np.arange(u.size) / RATE,
        ground=np.zeros(u.size),
    )
    answer = force_response(truth, u, v, RATE, conditions=conditions, states=states)
    force = answer.force
    std = np.full(u.size, noise * float(np.sqrt(np.mean(force**2))))
    band = whitening(rng.standard_normal(u.size), RATE, white(std, BAND).at)
    made = Observation(
        name=f"event {number}",
        direction="x",
        start=start,
        rate=RATE,
        layer=LayerHistory(u, v, force + band.back(rng.standard_normal(band.std.size)), std),
        conditions=conditions,
        ground_acceleration=None,
        accelerations=np.zeros((0, u.size)),
        levels=(),
        transducer=True,
    )
    return made, answer.states
