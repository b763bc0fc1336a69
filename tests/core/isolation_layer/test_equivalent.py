"""k_eq and c_eq against the describing function (first harmonic) of the true law.

The cycles that count have an amplitude of at least a tenth of the event's largest displacement. Bias is the mean,
scatter the plain standard deviation, outliers and all; the robust one (1.4826 times the median absolute deviation)
stands beside it. One draw of the noise has 240 cycles; `benchmarks/restoring_force.py` measures two.
"""

from itertools import product

import numpy as np
import pytest
from accuracy import GOALS
from describing_function import MOTIONS, SCALES, cycle_errors, describing_function, record_errors, robust_spread
from hypothesis import given, strategies as st

from core.analysis import AnalysisSettings
from core.isolation_layer.equivalent import (
    cycles,
    determined,
    equivalent_segments,
    windows,
    with_force_errors,
)
from core.isolation_layer.motion import Motion
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR


@pytest.mark.parametrize(("amplitude", "published"), [(0.1, 904), (1, 834), (3, 682), (10, 521), (40, 481)])
def test_describing_function_of_table_ii(amplitude: float, published: float) -> None:
    """mm and MN/m, printed to three digits."""
    assert describing_function(amplitude / 1000)[0] / 1e6 == pytest.approx(published, abs=1.0)


@pytest.mark.accuracy
def test_cycles_of_the_papers_building_at_one_percent_noise() -> None:
    """Measured: k_eq bias −0.3 %, scatter 1.6 % (robust 0.47); c_eq −0.3 %, 7.1 % (2.1); covered are 97 and 99 %."""
    error, std = np.moveaxis(record_errors(0.01, AnalysisSettings(), draws=1), 1, 0)
    assert len(error) > 200
    assert (np.abs(error.mean(axis=0)) < [0.02, 0.05]).all()
    assert (error.std(axis=0) < [0.02, 0.10]).all()
    assert (np.mean(np.abs(error) < 1.96 * std, axis=0) > 0.87).all()


@pytest.mark.accuracy
@pytest.mark.parametrize("estimator", GOALS)
def test_cycles_of_the_papers_building_at_ten_percent_noise(estimator: str) -> None:
    """Measured: k_eq bias −0.2 %, scatter 1.9 % (robust 1.03); c_eq 0.1 %, 13.0 % (7.3); covered are 97 and 97 %."""
    error, std = np.moveaxis(record_errors(0.1, AnalysisSettings(estimator=estimator), draws=1), 1, 0)
    assert len(error) > 200
    assert (np.abs(error.mean(axis=0)) < [0.01, 0.05]).all()
    assert (error.std(axis=0) < [0.035, 0.22]).all()
    assert (np.mean(np.abs(error) < 1.96 * std, axis=0) > 0.9).all()


@pytest.mark.accuracy
def test_cycles_with_the_exact_force() -> None:
    """Measured: k_eq bias −0.3 %, scatter 1.5 % (robust 0.42); c_eq −0.3 %, 7.0 % (1.2).

    The plain scatter of k_eq stays above 1 %: within a cycle the amplitude grows or falls, and a describing function
    knows none that does.
    """
    results = []
    for motion, scale in product(MOTIONS, SCALES):
        moved = simulate(BUILDING, ISOLATOR, motion() * scale, 100.0)
        largest = np.abs(moved.isolator_displacement).max()
        layer = Motion(moved.isolator_displacement, moved.isolator_velocity)
        spans = cycles(layer.displacement, 1e-5)
        results.append(cycle_errors(determined(equivalent_segments(moved.force, layer, 100.0, spans)), largest))
    error = np.concatenate(results)[:, 0]
    assert (np.abs(error.mean(axis=0)) < [0.01, 0.05]).all()
    assert (error.std(axis=0) < [0.02, 0.10]).all()
    assert (robust_spread(error) < [0.01, 0.10]).all()


def test_what_is_mostly_rest_or_mixes_two_frequencies_is_no_cycle() -> None:
    time = np.arange(400) / 100
    pulse = np.where(time < 1, np.sin(2 * np.pi * time), -0.01)  # an oscillation, then rest a little off zero
    mixed = np.sin(2 * np.pi * time / 4) + 0.8 * np.sin(2 * np.pi * time / 4 * 3)
    sine = 0.1 * np.sin(2 * np.pi * time / 4)
    for history, count in ((pulse, 0), (mixed, 0), (sine, 1), (sine + 0.005 * mixed, 1)):
        three = np.concatenate([sine, history, sine])
        assert len([1 for start, _ in cycles(three, 0.01) if abs(start - 400) < 2]) == count


def test_a_segment_that_does_not_determine_its_stiffness_is_omitted() -> None:
    time = np.arange(2000) / 100
    motion = Motion(np.sin(np.pi * time + 1), np.pi * np.cos(np.pi * time + 1))
    noise = np.random.default_rng(9).standard_normal(time.size)
    for level, share in ((0.1, 1.0), (10.0, 0.0)):
        segments = equivalent_segments(
            motion.displacement + level * noise, motion, 100.0, cycles(motion.displacement, 0.5)
        )
        assert len(determined(segments)) == share * len(segments) == share * 9


@given(k=st.floats(1e6, 1e9), c=st.floats(0, 1e8), offset=st.floats(-1e6, 1e6), amplitude=st.floats(1e-3, 0.3))
def test_a_spring_and_a_dashpot_are_detected_exactly(k: float, c: float, offset: float, amplitude: float) -> None:
    time = np.arange(2000) / 100
    motion = Motion(amplitude * np.sin(np.pi * time + 1), np.pi * amplitude * np.cos(np.pi * time + 1))
    force = k * motion.displacement + c * motion.velocity + offset
    segments = equivalent_segments(force, motion, 100.0, cycles(motion.displacement, amplitude / 2), 0.2)
    assert len(segments) == 9
    for segment in segments:
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


def test_an_error_of_the_force_that_looks_like_a_spring_and_one_like_a_dashpot_are_part_of_the_deviations() -> None:
    """No residual shows either: without noise the deviations would be zero."""
    time = np.arange(0, 20, 0.01)
    motion = Motion(displacement=0.01 * np.sin(np.pi * time), velocity=0.01 * np.pi * np.cos(np.pi * time))
    force = 4e5 * motion.displacement + 2e4 * motion.velocity
    segments = equivalent_segments(force, motion, 100.0, cycles(motion.displacement, 1e-3))
    errors = np.array([3e3 * motion.displacement, -4e3 * motion.displacement, 7e2 * motion.velocity])
    assert len(segments) > 5
    for plain, wider in zip(segments, with_force_errors(segments, errors, motion, 100.0), strict=True):
        assert plain.k_eq_std < 1.0
        assert (wider.k_eq, wider.c_eq) == (plain.k_eq, plain.c_eq)
        assert wider.k_eq_std == pytest.approx(5e3)
        assert wider.c_eq_std == pytest.approx(7e2)
