"""k_eq and c_eq against the describing function (first harmonic) of the true law.

The cycles that count have an amplitude of at least a tenth of the event's largest displacement. Scatter is the
robust standard deviation, 1.4826 times the median absolute deviation: the few cycles in which two frequencies mix
have no single amplitude, so that the describing function of one is not their truth.
"""

import numpy as np
import pytest
from described import exact, paper, records, segments
from hypothesis import given
from hypothesis import strategies as st
from motions import akt013, chi_chi, kobe

from core.analysis import AnalysisSettings, analyse
from core.displacement import Motion
from core.equivalent import EquivalentSegment, cycles, equivalent_segments, regression, windows
from core.paper import BUILDING, ISOLATOR
from core.simulation import simulate

LAW = {name: value for values in ISOLATOR.effects.values() for name, value in values.items()}
MOTIONS = (akt013, kobe, chi_chi)


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


@pytest.mark.parametrize(("amplitude", "published"), [(0.1, 904), (1, 834), (3, 682), (10, 521), (40, 481)])
def test_describing_function_of_table_ii(amplitude: float, published: float) -> None:
    """mm and MN/m, printed to three digits."""
    assert describing_function(amplitude / 1000)[0] / 1e6 == pytest.approx(published, abs=1.0)


def errors(found: tuple[EquivalentSegment, ...], largest: float) -> np.ndarray:
    """(cycles, 2) relative errors of k_eq and c_eq of the cycles that count."""
    grid = np.geomspace(1e-5, 0.5, 60)
    k, c = np.array([describing_function(a, 1 / (2 * np.pi), 800) for a in grid]).T
    counting = [s for s in found if s.amplitude >= 0.1 * largest]
    a, ω = np.array([(s.amplitude, 2 * np.pi / (s.end - s.start)) for s in counting]).T
    truth_k = np.interp(np.log(a), np.log(grid), k)
    truth_c = LAW["c_b"] + np.interp(np.log(a), np.log(grid), c - LAW["c_b"]) / ω
    measured = np.array([(s.k_eq, s.c_eq) for s in counting])
    return measured / np.column_stack([truth_k, truth_c]) - 1


def spread(error: np.ndarray) -> np.ndarray:
    return 1.4826 * np.median(np.abs(error - np.median(error, axis=0)), axis=0)


def test_cycles_of_the_papers_building_at_one_percent_noise() -> None:
    error = []
    for seed, motion in enumerate(MOTIONS):
        result = analyse(segments(records(seed, 0.01, motion)), paper(), AnalysisSettings())
        error.append(errors(result.directions["x"].equivalent, np.abs(exact(motion, 1.0)[-1]).max()))
    every = np.concatenate(error)
    assert len(every) > 40
    assert (np.abs(np.median(every, axis=0)) < [0.02, 0.05]).all()
    assert (spread(every) < [0.02, 0.10]).all()


def test_cycles_with_the_exact_force() -> None:
    error = []
    for motion in MOTIONS:
        moved = simulate(BUILDING, ISOLATOR, motion(), 100.0)
        largest = np.abs(moved.isolator_displacement).max()
        layer = Motion(moved.isolator_displacement, moved.isolator_velocity)
        spans = cycles(layer.displacement, 1e-4)
        error.append(errors(equivalent_segments(moved.force, layer, 100.0, spans), largest))
    every = np.concatenate(error)
    assert (np.abs(np.median(every, axis=0)) < [0.01, 0.05]).all()
    assert (spread(every) < [0.01, 0.10]).all()


@given(k=st.floats(1e6, 1e9), c=st.floats(0, 1e8), offset=st.floats(-1e6, 1e6), amplitude=st.floats(1e-3, 0.3))
def test_a_spring_and_a_dashpot_are_found_exactly(k: float, c: float, offset: float, amplitude: float) -> None:
    time = np.arange(2000) / 100
    motion = Motion(amplitude * np.sin(np.pi * time + 1), np.pi * amplitude * np.cos(np.pi * time + 1))
    force = k * motion.displacement + c * motion.velocity + offset
    found = equivalent_segments(force, motion, 100.0, cycles(motion.displacement, amplitude / 2), 0.2)
    assert len(found) == 9
    for segment in found:
        assert (segment.k_eq, segment.c_eq) == (pytest.approx(k), pytest.approx(c, abs=1e-6 * k))
        assert segment.amplitude == pytest.approx(amplitude, rel=0.01)  # a cycle is whole to one sample in 200
        assert segment.shear_strain == segment.amplitude / 0.2


def test_noise_that_crosses_zero_makes_no_cycle() -> None:
    time = np.arange(4000) / 100
    rng = np.random.default_rng(1)
    displacement = 0.01 * np.sin(np.pi * time) + 2e-4 * rng.standard_normal(time.size)
    assert [end - start for start, end in cycles(displacement, 2e-3)] == pytest.approx([200] * 18, abs=4)
    assert cycles(displacement, 0.02) == ()


def test_the_papers_windows_follow_each_other() -> None:
    assert windows(1050, 100.0, 2.0) == ((0, 200), (200, 400), (400, 600), (600, 800), (800, 1000))


def test_standard_deviations_hold_when_residuals_are_autocorrelated() -> None:
    """Coverage of ± 1.96 standard deviations; one cycle is short, so Newey-West stays somewhat below 95 %."""
    rng = np.random.default_rng(2)
    time = np.arange(200) / 100
    regressors = np.column_stack([np.sin(np.pi * time), np.cos(np.pi * time), np.ones(200)])
    covered = plain = 0
    for _ in range(1000):
        noise = np.zeros(300)
        for i, shock in enumerate(rng.standard_normal(299), start=1):
            noise[i] = 0.8 * noise[i - 1] + shock
        solution, covariance = regression(regressors, regressors @ [3.0, 1.0, 0.5] + noise[100:])
        covered += abs(solution[0] - 3.0) < 1.96 * np.sqrt(covariance[0, 0])
        residual = regressors @ (solution - [3.0, 1.0, 0.5]) - noise[100:]
        plain += abs(solution[0] - 3.0) < 1.96 * np.sqrt(
            residual.var() * np.linalg.inv(regressors.T @ regressors)[0, 0]
        )
    assert 0.82 < covered / 1000 < 0.97
    assert plain / 1000 < 0.65
