from dataclasses import replace

import ground_motions
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from core.errors import ModelError, RecordError
from core.estimators import ESTIMATORS
from core.estimators.cms import channel_weights, completed, estimate, force_of_shapes, shape_matrix
from core.estimators.substructure import assumed_stiffness, expanded, static_shapes
from core.estimators.superstructure import InstrumentedSuperstructure
from core.model.simulation import simulate
from core.paper import BUILDING, ISOLATOR
from core.signals.noise import noise_std

sensors = st.sets(st.integers(0, 6), min_size=1).map(lambda floors: np.array(sorted(floors)))


def superstructure(rng: np.random.Generator, measured: np.ndarray, samples: int = 1200) -> InstrumentedSuperstructure:
    return InstrumentedSuperstructure(
        rate=100.0,
        base_acceleration=rng.standard_normal(samples),
        floor_acceleration=rng.standard_normal((measured.size, samples)),
        measured=measured,
        base_mass=8e6,
        floor_mass=rng.uniform(1e6, 3e6, 7),
    )


def interpolated_inertia(s: InstrumentedSuperstructure) -> np.ndarray:
    relative = static_shapes(assumed_stiffness(s.floor_mass), s.measured) @ (s.floor_acceleration - s.base_acceleration)
    return -s.base_mass * s.base_acceleration - s.floor_mass @ (relative + s.base_acceleration)


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), measured=sensors, surplus=st.integers(0, 3))
def test_enough_shapes_cancel_out_of_the_force(seed: int, measured: np.ndarray, surplus: int) -> None:
    """Whatever the shapes, F = -Σ m_i a_i over statically interpolated floors."""
    rng = np.random.default_rng(seed)
    s = superstructure(rng, measured)
    at_sensors = np.hstack(
        [np.linalg.qr(rng.standard_normal((measured.size,) * 2)).Q, np.ones((measured.size, surplus))]
    )
    shapes = expanded(at_sensors, assumed_stiffness(s.floor_mass), measured)
    exact = interpolated_inertia(s)
    force = force_of_shapes(s, shapes, ()).force
    assert np.abs(force - exact).max() < 1e-9 * np.abs(exact).max()


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), measured=sensors)
def test_too_few_shapes_are_completed(seed: int, measured: np.ndarray) -> None:
    rng = np.random.default_rng(seed)
    s = superstructure(rng, measured)
    few = expanded(
        rng.standard_normal((measured.size, rng.integers(0, measured.size))), assumed_stiffness(s.floor_mass), measured
    )
    result = force_of_shapes(s, completed(few, s), ())
    exact = interpolated_inertia(s)
    assert np.abs(result.force - exact).max() < 1e-9 * np.abs(exact).max()
    assert result.force == pytest.approx(result.rigid + result.modal)


def test_a_record_too_short_for_any_mode_still_gives_the_force() -> None:
    s = superstructure(np.random.default_rng(1), np.arange(7))
    result = estimate(s)
    assert result.modes == ()
    assert result.force == pytest.approx(interpolated_inertia(s))


@pytest.mark.accuracy
def test_std_is_that_of_the_sensors_noise_where_every_floor_is_measured() -> None:
    rng = np.random.default_rng(2)
    truth = simulate(BUILDING, ISOLATOR, ground_motions.akt013(), ground_motions.RATE)
    clean = np.vstack([truth.base_acceleration, truth.floor_acceleration])
    given = 0.01 * clean.std(axis=1)
    noisy = clean + given[:, None] * rng.standard_normal(clean.shape)
    s = InstrumentedSuperstructure(100.0, noisy[0], noisy[1:], np.arange(7), BUILDING.base_mass, BUILDING.floor_mass)
    result = estimate(s)
    without = estimate(replace(s, base_acceleration=clean[0], floor_acceleration=clean[1:]))
    # A level from 36 half-overlapping spectra of 70 lines is good to some 3 %.
    assert result.std == pytest.approx(np.std(result.force - without.force), rel=0.1)
    assert noise_std(noisy, 100.0) == pytest.approx(given, rel=0.1)


def test_std_is_larger_by_the_inertia_that_the_interpolation_leaves_out() -> None:
    """From two of seven floors, at 1 % noise: the force is off by ten times what noise does."""
    rng = np.random.default_rng(4)
    truth = simulate(BUILDING, ISOLATOR, ground_motions.akt013(), ground_motions.RATE)
    clean = np.vstack([truth.base_acceleration, truth.floor_acceleration[[2, 6]]])
    noisy = clean + 0.01 * clean.std(axis=1, keepdims=True) * rng.standard_normal(clean.shape)
    s = InstrumentedSuperstructure(
        100.0, noisy[0], noisy[1:], np.array([2, 6]), BUILDING.base_mass, BUILDING.floor_mass
    )
    exact = -BUILDING.base_mass * truth.base_acceleration - BUILDING.floor_mass @ truth.floor_acceleration
    estimated = estimate(s)
    assert 0.90 <= np.mean(np.abs(estimated.force - exact) <= 1.96 * estimated.std) <= 0.98


def test_modes_come_with_their_deviations() -> None:
    """At 1 % of noise the first frequencies are known to a part in a thousand, the damping ratios to a twentieth."""
    rng = np.random.default_rng(3)
    truth = simulate(BUILDING, ISOLATOR, ground_motions.akt013(), ground_motions.RATE)
    clean = np.vstack([truth.base_acceleration, truth.floor_acceleration[[2, 6]]])
    noisy = clean + 0.01 * clean.std(axis=1, keepdims=True) * rng.standard_normal(clean.shape)
    modes = estimate(
        InstrumentedSuperstructure(
            100.0, noisy[0], noisy[1:], np.array([2, 6]), BUILDING.base_mass, BUILDING.floor_mass
        )
    ).modes[:2]
    for mode in modes:
        assert mode.frequency_std is not None
        assert 0 < mode.frequency_std < 1e-3 * mode.frequency
        assert mode.damping_ratio_std is not None
        assert 0 < mode.damping_ratio_std < 0.05 * mode.damping_ratio


def test_force_is_the_weighted_sum_of_the_channels() -> None:
    s = superstructure(np.random.default_rng(4), np.array([1, 4, 6]))
    shapes = completed(shape_matrix((), 7), s)
    channels = np.vstack([s.base_acceleration, s.floor_acceleration])
    assert channel_weights(s, shapes) @ channels == pytest.approx(force_of_shapes(s, shapes, ()).force)


@pytest.mark.parametrize("name", sorted(ESTIMATORS))
def test_every_estimator_refuses_what_it_cannot_use(name: str) -> None:
    s = superstructure(np.random.default_rng(5), np.array([2, 6]))
    gap = s.base_acceleration.copy()
    gap[7] = np.nan
    with pytest.raises(RecordError, match="gaps"):
        ESTIMATORS[name](replace(s, base_acceleration=gap))
    with pytest.raises(RecordError, match="do not fit"):
        ESTIMATORS[name](replace(s, measured=np.array([2])))
    with pytest.raises(ModelError, match="mass must be positive"):
        ESTIMATORS[name](replace(s, base_mass=0.0))
    with pytest.raises(RecordError, match="too short"):
        ESTIMATORS[name](
            replace(s, base_acceleration=s.base_acceleration[:900], floor_acceleration=s.floor_acceleration[:, :900])
        )
