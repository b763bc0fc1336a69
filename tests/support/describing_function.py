"""k_eq and c_eq of the paper's isolation layer at an amplitude, and the deviations of cycles from them."""

from collections.abc import Sequence
from functools import cache

import numpy as np
from building_models import exact, paper, records, segments
from ground_motions import akt013, chi_chi, kobe

from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.isolation_layer.equivalent import EquivalentSegment
from core.paper import ISOLATOR

LAW = {name: value for values in ISOLATOR.effects.values() for name, value in values.items()}
MOTIONS = (akt013, kobe, chi_chi)
SCALES = (0.05, 1.0, 4.0)
"""Factors on 70 gal."""
COUNTED = 0.1
"""Smallest amplitude of a cycle that counts, as a fraction of the event's largest displacement."""


def describing_function(amplitude: float, frequency: float = 0.5, samples: int = 4000) -> tuple[float, float]:
    """k_eq and c_eq of Table II's law under a sine, by its own differential equation (eq 22)."""
    phase = 2 * np.pi * np.arange(4 * samples + 1) / samples
    z, force = 0.0, np.zeros(phase.size)
    steps = np.diff(amplitude * np.sin(phase)) / LAW["D_y"]
    for i, step in enumerate(steps):
        half = z + 0.5 * step * (1 - (LAW["gamma"] * np.sign(z * step) + LAW["beta"]) * abs(z))
        z += step * (1 - (LAW["gamma"] * np.sign(half * step) + LAW["beta"]) * abs(half))
        force[i + 1] = LAW["F_y"] * z
    last, at = force[-samples:], phase[-samples:]
    stiff, lossy = 2 * np.mean(last * np.sin(at)), 2 * np.mean(last * np.cos(at))
    return LAW["k_b"] + stiff / amplitude, LAW["c_b"] + lossy / (amplitude * 2 * np.pi * frequency)


def cycle_errors(found: Sequence[EquivalentSegment], largest: float) -> np.ndarray:
    """(cycles, 2, 2) relative errors of k_eq and c_eq of the cycles that count, and their standard deviations."""
    grid, k, c = _table()
    counting = [s for s in found if s.amplitude >= COUNTED * largest]
    a, ω = np.array([(s.amplitude, 2 * np.pi / (s.end - s.start)) for s in counting]).T
    truth_k = np.interp(np.log(a), np.log(grid), k)
    truth_c = LAW["c_b"] + np.interp(np.log(a), np.log(grid), c - LAW["c_b"]) / ω
    truth = np.column_stack([truth_k, truth_c])
    measured = np.array([(s.k_eq, s.c_eq) for s in counting])
    return np.stack([measured / truth - 1, np.array([(s.k_eq_std, s.c_eq_std) for s in counting]) / truth], axis=1)


def record_errors(noise: float, settings: AnalysisSettings, draws: int = 2) -> np.ndarray:
    """Errors as of `cycle_errors` over nine records for each draw of the noise: three motions, 3.5 to 280 gal."""
    found = []
    for seed, (motion, scale) in enumerate((m, s) for m in MOTIONS for s in SCALES * draws):
        result = analyse(segments(records(seed, noise, motion, scale)), paper(), settings)
        found.append(cycle_errors(result.directions["x"].equivalent, np.abs(exact(motion, scale)[-1]).max()))
    return np.concatenate(found)


def robust_spread(error: np.ndarray) -> np.ndarray:
    """1.4826 times the median absolute deviation, of each column: a normal distribution's standard deviation."""
    return np.asarray(1.4826 * np.median(np.abs(error - np.median(error, axis=0)), axis=0))


@cache
def _table() -> tuple[Vector, Vector, Vector]:
    """Amplitudes in m, and k_eq and ω (c_eq − c_b) there."""
    grid = np.geomspace(1e-6, 0.5, 80)
    k, c = np.array([describing_function(a, 1 / (2 * np.pi), 800) for a in grid]).T
    return grid, k, c
