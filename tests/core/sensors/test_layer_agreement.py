"""Gains, delays and clock rates of base slab and ground are estimated against the transducer, as well as stated."""

import consistent_sensors
import numpy as np
import pytest
from building_models import bncs, bncs_segments
from consistent_sensors import RATE
from ground_motions import kobe
from hypothesis import example, given, settings, strategies as st
from real_building import TESTS
from sampled_response import sampled_response
from scipy.signal import butter, sosfiltfilt
from shared_data import needs_shared

from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.errors import RecordError
from core.sensors.layer_agreement import agreeing as brought_to_agree, is_integral, layer_agreement

NOTHING = np.zeros(6)
SMALL = np.array([0.1, 0.02, 5e-4, -0.08, -0.01, -3e-4])
TRIALS = 12


@pytest.mark.parametrize("errors", [NOTHING, SMALL, np.array([-0.3, 0.05, 1e-3, 0.25, -0.05, -1e-3])])
def test_errors_are_detected_without_noise(errors: Vector) -> None:
    """Up to the transducer's 0.01 mm: 2e-4 of gain, 0.2 ms and 2e-5 s/s is three times what that makes."""
    agreement = layer_agreement(*consistent_sensors.layer_sensors(np.random.default_rng(1), 0.0, errors), RATE)
    assert agreement is not None
    assert np.abs(agreement.value - errors) == pytest.approx(NOTHING, abs=3e-4)
    assert (np.abs(agreement.value - errors)[[1, 2, 4, 5]] < np.tile([2e-4, 2e-5], 2)).all()


@pytest.mark.parametrize("noise", [0.01, 0.1])
@pytest.mark.parametrize("errors", [NOTHING, SMALL])
def test_std_is_that_of_the_errors(noise: float, errors: Vector) -> None:
    """The root mean square of 72 errors over their std is 1 ± 0.08 if the std is right; three times that is allowed."""
    scores = []
    for seed in range(TRIALS):
        agreement = layer_agreement(*consistent_sensors.layer_sensors(np.random.default_rng(seed), noise, errors), RATE)
        assert agreement is not None
        scores.append((agreement.value - errors) / np.sqrt(np.diag(agreement.covariance)))
    assert 0.75 < np.sqrt(np.mean(np.square(scores))) < 1.25


@settings(max_examples=15, deadline=None)
@example((0.25, 0.0, 0.0, -0.25, 0.0, 0.0), 306, 0.01)  # far off, the residuals are taken for noise
@example((0.3, 0.05, 1e-3, -0.3, -0.05, -1e-3), 270, 0.01)
@given(
    st.tuples(*[st.floats(-0.3, 0.3), st.floats(-0.05, 0.05), st.floats(-1e-3, 1e-3)] * 2),
    st.integers(0, 1000),
    st.sampled_from([0.01, 0.03, 0.1]),
)
def test_any_error_is_detected_within_its_std(errors: tuple[float, ...], seed: int, noise: float) -> None:
    """Five and a half standard deviations are exceeded by chance once in ten million."""
    agreement = layer_agreement(
        *consistent_sensors.layer_sensors(np.random.default_rng(seed), noise, np.array(errors)), RATE
    )
    assert agreement is not None
    assert (np.abs(agreement.value - errors) < 5.5 * np.sqrt(np.diag(agreement.covariance))).all()


def test_a_transducer_that_reads_too_much_is_both_sides_reading_too_little() -> None:
    displacement, base, ground = consistent_sensors.layer_sensors(np.random.default_rng(3), 0.03, NOTHING)
    agreement = layer_agreement(1.1 * displacement, base, ground, RATE)
    assert agreement is not None
    assert agreement.value[[0, 3]] == pytest.approx(
        np.full(2, -np.log(1.1)), abs=5 * np.sqrt(agreement.covariance[3, 3])
    )


def test_too_short_a_record_gives_no_finding() -> None:
    displacement, base, ground = consistent_sensors.layer_sensors(np.random.default_rng(4), 0.03, NOTHING)
    assert layer_agreement(displacement[:1100], base[:1100], ground[:1100], RATE) is None
    with pytest.raises(RecordError, match="10 s"):
        layer_agreement(displacement[:900], base[:900], ground[:900], RATE)


def test_noise_alone_gives_no_finding() -> None:
    """A loose cable: the noise of the record's end is that of its middle, and explains all of it."""
    rng = np.random.default_rng(5)
    displacement, base, _ = consistent_sensors.layer_sensors(rng, 0.03, NOTHING)
    assert layer_agreement(displacement, base, rng.standard_normal(base.size), RATE) is None


def test_accelerations_are_brought_to_agree_with_the_transducer() -> None:
    """Gains of 2 and -1 %, delays of 3 and -2 ms: nine tenths of their change is reversed, but for the noise."""
    errors = np.array([0.02, 3e-3, 0.0, -0.01, -2e-3, 0.0])
    exact, wrong = (consistent_sensors.layer_sensors(np.random.default_rng(2), 0.0, one) for one in (NOTHING, errors))
    mended = brought_to_agree(*wrong, RATE)
    for true, before, after in zip(exact[1:], wrong[1:], mended, strict=True):
        assert np.linalg.norm(after - true) < 0.1 * np.linalg.norm(before - true)


def measured(seed: int, transducer: float, accelerometer: float) -> tuple[Vector, Vector]:
    """m and m/s², with white noise of these standard deviations."""
    moved, rng = sampled_response(kobe), np.random.default_rng(seed)
    relative = moved.base_acceleration - moved.ground_acceleration
    noise = rng.standard_normal((2, relative.size)) * [[transducer], [accelerometer]]
    return moved.displacement + noise[0], relative + noise[1]


def integral(relative: Vector, lowest: float) -> Vector:
    """Twice, above a frequency."""
    ω = 2 * np.pi * np.fft.rfftfreq(relative.size, 1 / RATE)
    lines = np.fft.rfft(relative)
    lines[1:] /= -(ω[1:] ** 2)
    lines[0] = 0.0
    raw = np.fft.irfft(lines, relative.size)
    return np.asarray(sosfiltfilt(butter(4, lowest, "highpass", fs=RATE, output="sos"), raw))


@pytest.mark.parametrize("accelerometer", [1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("transducer", [2e-6, 2e-5, 1e-3])
def test_a_transducer_is_a_measurement(transducer: float, accelerometer: float) -> None:
    assert not is_integral(*measured(3, transducer, accelerometer), RATE)


def test_a_transducer_is_one_without_noise() -> None:
    assert not is_integral(*measured(3, 0.0, 0.0), RATE)


def test_a_transducer_is_one_through_an_anti_alias_filter() -> None:
    """This removes the noise that would reveal the fault."""
    displacement, relative = measured(3, 2e-5, 1e-3)
    filtered = sosfiltfilt(butter(8, 10.0, fs=RATE, output="sos"), displacement)
    assert not is_integral(np.asarray(filtered), relative, RATE)


@pytest.mark.parametrize("lowest", [0.1, 0.15, 0.3])
@pytest.mark.parametrize("accelerometer", [1e-3, 1e-2])
def test_an_integral_is_none(lowest: float, accelerometer: float) -> None:
    _, relative = measured(4, 0.0, accelerometer)
    assert is_integral(integral(relative, lowest), relative, RATE)


@needs_shared
@pytest.mark.parametrize("test", TESTS)
def test_the_real_building_has_no_transducer(test: str) -> None:
    """Its displacement was integrated by whoever published it; the analysis says so, and how well it knows it."""
    analysis = analyse(bncs_segments(test), bncs(), AnalysisSettings(estimator="cms"))
    motion = analysis.directions["x"].motion
    assert motion is not None
    assert motion.is_integrated
    assert motion.residual is None
    assert motion.peak[1] > 5e-4
    printed = [finding.message for finding in analysis.quality if finding.kind == "displacement"]
    assert any("integrated twice" in message for message in printed)
