"""Gains, delays and clock rates of floors are estimated against the base slab, for any quasi-static deflection."""

import consistent_sensors
import numpy as np
import pytest
from consistent_sensors import RATE
from hypothesis import given, settings, strategies as st

from core.arrays import Vector
from core.errors import RecordError
from core.sensors.floor_agreement import floor_agreement
from core.sensors.sensor_errors import SensorDifference, sensor_errors

NOTHING = np.zeros(6)
SMALL = np.array([0.1, 0.015, 4e-4, -0.08, -0.01, -3e-4])
TRIALS = 12


@pytest.mark.parametrize("errors", [NOTHING, SMALL])
def test_errors_are_detected_without_noise(errors: Vector) -> None:
    """The higher modes below 1.2 times the first frequency are not quite static: that leaves 3e-4 and 0.1 ms."""
    agreement = floor_agreement(*consistent_sensors.floor_sensors(np.random.default_rng(1), 0.0, errors), RATE)
    assert agreement is not None
    assert agreement.value == pytest.approx(errors, abs=3e-4)
    assert (np.abs(agreement.value - errors)[[1, 2, 4, 5]] < np.tile([1e-4, 2e-5], 2)).all()


@pytest.mark.parametrize("noise", [0.01, 0.1])
@pytest.mark.parametrize("errors", [NOTHING, SMALL])
def test_std_is_that_of_the_errors(noise: float, errors: Vector) -> None:
    """The root mean square of 72 errors over their std is 1 ± 0.08 if the std is right; three times that is allowed."""
    scores = []
    for seed in range(TRIALS):
        agreement = floor_agreement(*consistent_sensors.floor_sensors(np.random.default_rng(seed), noise, errors), RATE)
        assert agreement is not None
        scores.append((agreement.value - errors) / np.sqrt(np.diag(agreement.covariance)))
    assert 0.75 < np.sqrt(np.mean(np.square(scores))) < 1.25


@pytest.mark.parametrize("quantity", range(3))
def test_the_std_of_each_quantity_is_that_of_its_errors(quantity: int) -> None:
    """Gain, delay and rate of delay: 100 errors of one floor over their std have a root mean square of 1 ± 0.07; three
    times that is allowed."""
    scores = []
    for seed in range(100):
        agreement = floor_agreement(*consistent_sensors.floor_sensors(np.random.default_rng(seed), 0.1, NOTHING), RATE)
        assert agreement is not None
        scores.append(agreement.value[quantity] / np.sqrt(agreement.covariance[quantity, quantity]))
    assert 0.79 < np.sqrt(np.mean(np.square(scores))) < 1.21


@settings(max_examples=15, deadline=None)
@given(
    st.tuples(*[st.floats(-0.25, 0.25), st.floats(-0.04, 0.04), st.floats(-1e-3, 1e-3)] * 2),
    st.integers(0, 1000),
    st.sampled_from([0.01, 0.03, 0.1]),
)
def test_any_error_is_detected_within_its_std(errors: tuple[float, ...], seed: int, noise: float) -> None:
    """Six standard deviations, since the std of records with little motion at low frequencies is itself rough."""
    agreement = floor_agreement(
        *consistent_sensors.floor_sensors(np.random.default_rng(seed), noise, np.array(errors)), RATE
    )
    assert agreement is not None
    assert (np.abs(agreement.value - errors) < 6 * np.sqrt(np.diag(agreement.covariance))).all()


def test_a_base_slab_that_reads_too_much_is_every_floor_reading_too_little() -> None:
    base, floors = consistent_sensors.floor_sensors(np.random.default_rng(3), 0.03, NOTHING)
    agreement = floor_agreement(1.1 * base, floors, RATE)
    assert agreement is not None
    assert agreement.value[[0, 3]] == pytest.approx(
        np.full(2, -np.log(1.1)), abs=5 * np.sqrt(agreement.covariance[3, 3])
    )


def test_a_reversed_floor_has_no_gain() -> None:
    base, floors = consistent_sensors.floor_sensors(np.random.default_rng(3), 0.03, NOTHING)
    assert floor_agreement(base, floors * [[1], [-1]], RATE) is None


def test_too_short_a_record_is_refused() -> None:
    base, floors = consistent_sensors.floor_sensors(np.random.default_rng(4), 0.03, NOTHING)
    with pytest.raises(RecordError, match="10 s"):
        floor_agreement(base[:900], floors[:, :900], RATE)


def test_a_record_that_begins_in_motion_gives_no_finding() -> None:
    base, floors = consistent_sensors.floor_sensors(np.random.default_rng(4), 0.03, NOTHING)
    assert floor_agreement(base[2500:], floors[:, 2500:], RATE) is None


def with_tuned_mass(base: Vector) -> np.ndarray:
    """(2, n) m/s², a middle floor and a roof that carries a tuned mass: it splits the first mode of 1.3 Hz in two, with
    more damping."""
    frequency, spectrum = np.fft.rfftfreq(2 * base.size, 1 / RATE), np.fft.rfft(base, 2 * base.size)
    modes = [frequency**2 / (f**2 - frequency**2 + 2j * ζ * f * frequency) for f, ζ in ((0.9, 0.05), (1.5, 0.03))]
    first = 0.2 * modes[0] + 0.8 * modes[1]
    return np.asarray(np.fft.irfft(spectrum * (1 + np.outer([0.8, 1.3], first)), 2 * base.size)[:, : base.size])


def test_what_the_model_of_a_building_lacks_is_no_late_clock() -> None:
    """A mode more than the model's passes for a delay that grows with height, in every earthquake: 4 to 55 ms. Three
    standard deviations."""
    seen = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        base = consistent_sensors.Motion.drawn(rng, -1.0).at(consistent_sensors.TIME)
        own, *floors = consistent_sensors.with_noise(np.vstack([base, with_tuned_mass(base)]), 0.01, rng)
        agreement = floor_agreement(own, np.array(floors), RATE)
        assert agreement is not None
        assert (np.abs(agreement.value) < 3 * np.sqrt(np.diag(agreement.covariance))).all()
        seen.append(SensorDifference(("4F", "RF"), "1F", agreement.value, agreement.covariance))
    assert sensor_errors(seen) == ()
