"""A drifting transducer is distinguished from a layer that comes to rest elsewhere, and from one that still moves."""

from functools import cache

import numpy as np
import pytest
from building_models import BASE, FOURTH, GROUND, LAYER, ROOF, bncs, bncs_segments, paper, records, segments
from hypothesis import given, strategies as st
from shared_data import needs_shared
from yielding_layer import yielding_layer

from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.arrays import Vector
from core.sensors.resting_level import baseline_drift, transducer_drift, without_drift

RATE = 100.0
TIME: Vector = np.arange(6000) / RATE


def motion(peak: float, offset: float, seed: int) -> Vector:
    """(6000,) m, strong from 10 s to 25 s and then dying away, with a residual offset from 20 s on."""
    rng = np.random.default_rng(seed)
    strong = np.exp(-(((TIME - 17) / 5) ** 2)) + 0.02 * np.exp(-((TIME - 17).clip(0) / 10)) * (TIME > 17)
    waves = sum(np.sin(2 * np.pi * f * TIME + rng.uniform(0, 6)) for f in rng.uniform(0.4, 1.0, 5))
    moved = strong * waves
    settled = offset / (1 + np.exp(-(TIME - 20) / 0.5))
    return np.asarray(peak * moved / np.abs(moved).max() + settled + 1e-5 * rng.standard_normal(TIME.size))


@given(st.floats(0.004, 0.2), st.floats(-0.01, 0.01), st.integers(0, 10**6))
def test_a_residual_offset_is_no_drift(peak: float, offset: float, seed: int) -> None:
    """Three standard deviations: the bound used for each block's sway is rarely reached."""
    reported = baseline_drift(motion(peak, offset, seed), RATE)
    assert reported is not None
    assert abs(reported.change) < 3 * reported.std


@given(st.floats(0.01, 0.2), st.floats(0.1, 0.5), st.integers(0, 10**6))
def test_a_steady_drift_is_detected(peak: float, share: float, seed: int) -> None:
    """Change between the first and the last block at rest; their own motion is within the std."""
    drift = share * peak * TIME / TIME[-1]
    reported = baseline_drift(motion(peak, 0.002, seed) + drift, RATE)
    assert reported is not None
    assert reported.change > 4 * reported.std
    assert reported.change == pytest.approx(reported.share * np.abs(motion(peak, 0.002, seed) + drift).max())
    assert reported.change < share * peak + 3 * reported.std


def test_a_record_without_rest_gives_no_finding() -> None:
    assert baseline_drift(np.sin(2 * np.pi * 0.5 * TIME), RATE) is None


def analysed(samples: dict[str, np.ndarray]) -> EventAnalysis:
    """By static interpolation, which takes half the smoother's time: sensors are judged before forces are estimated."""
    return analyse(segments(samples), paper(), AnalysisSettings(estimator="cms"))


@cache
def healthy_force(seed: int) -> np.ndarray:
    return analysed(records(seed)).directions["x"].restoring_force.force


def reported(result: EventAnalysis) -> list[tuple[str, str, str | None]]:
    """Findings of screening: a removed jump leaves traces, on which the estimator may remark."""
    of_screening = [finding for finding in result.quality if finding.kind != "estimator"]
    return [(finding.kind, finding.severity, finding.channel) for finding in of_screening]


@pytest.mark.parametrize(
    ("channel", "rest", "words"), [(BASE, 0.031, "3.1"), (ROOF, -0.2, "-20"), (LAYER, 0.012, "12")]
)
def test_a_channel_that_rests_far_from_zero_is_noted_in_both_units(channel: str, rest: float, words: str) -> None:
    samples = records(1)
    samples[channel] = samples[channel] + rest
    result = analysed(samples)
    assert reported(result) == [("offset", "note", channel)]
    assert result.quality[0].value == pytest.approx(rest, rel=0.02)
    assert f"({words}" in result.quality[0].message  # gal or mm
    force, same = healthy_force(1), result.directions["x"].restoring_force.force
    assert same == pytest.approx(force, abs=1e-6 * np.abs(force).max())


@pytest.mark.accuracy
@pytest.mark.parametrize("channel", [GROUND, BASE, FOURTH, ROOF])
@pytest.mark.parametrize("step", [0.02, -0.1])
def test_a_jump_of_an_accelerations_level_is_measured_and_taken_out(channel: str, step: float) -> None:
    samples = records(2)
    samples[channel] = samples[channel] + np.where(np.arange(18000) < 5230, 0, step)
    result = analysed(samples)
    assert reported(result) == [("offset", "warning", channel)]
    # Both levels are means over motion that 5 s do not average out: some 3 mm/s².
    assert result.quality[0].value == pytest.approx(step, abs=0.003)
    force, near = healthy_force(2), result.directions["x"].restoring_force.force
    # The instant is known to a fraction of a second, the level to 3 %: a short pulse of the step is left.
    assert np.linalg.norm(near - force) < 0.05 * np.linalg.norm(force)


def test_a_displacement_that_rests_elsewhere_after_the_event_is_no_fault() -> None:
    samples = records(3)
    samples[LAYER] = samples[LAYER] + 0.0005 * (np.arange(18000) > 6000)
    assert reported(analysed(samples)) == []


@needs_shared
def test_a_jump_in_a_record_of_the_real_building() -> None:
    pieces = bncs_segments("CNP100")
    for piece in pieces:
        if piece.channel == "XX.BNCS.04.HNX":
            piece.samples[3000:] += 0.05
    result = analyse(pieces, bncs(), AnalysisSettings())
    warnings = [one for one in reported(result) if one[1] != "note"]  # that displacement is an integral is noted too
    assert warnings == [("offset", "warning", "XX.BNCS.04.HNX")]
    assert {one[0] for one in reported(result) if one[1] == "note"} == {"displacement"}


@given(st.floats(0.01, 0.2), st.floats(0.02, 0.2), st.floats(3, 12), st.integers(0, 10**6))
def test_creep_after_the_motion_is_no_drift_of_the_transducer(
    peak: float, share: float, seconds: float, seed: int
) -> None:
    """Friction and rubber that relax go on after the motion, ever more slowly."""
    creep = share * peak * (1 - np.exp(-(TIME - 25).clip(0) / seconds))
    found = transducer_drift(motion(peak, 0.0, seed) + creep, RATE)
    assert found is None or abs(found.change) < 4 * found.std


@given(st.floats(0.01, 0.2), st.floats(0.1, 0.5), st.integers(0, 10**6))
def test_a_drift_goes_on_after_the_motion(peak: float, share: float, seed: int) -> None:
    found = transducer_drift(motion(peak, 0.002, seed) + share * peak * TIME / TIME[-1], RATE)
    assert found is not None
    assert found.change > 4 * found.std


@given(st.floats(0.01, 0.2), st.floats(0.1, 0.5), st.integers(0, 10**6))
def test_a_drift_is_removed_but_for_a_fiftieth(peak: float, share: float, seed: int) -> None:
    true = motion(peak, 0.0, seed)
    drift = share * peak * (0.4 * TIME / TIME[-1] + 0.6 * np.sin(np.pi * TIME / TIME[-1]))
    left = without_drift(true + drift, RATE) - true
    assert np.abs(left - left.mean()).max() < 0.02 * np.abs(drift).max() + 0.05 * peak


@pytest.mark.parametrize("seed", [0, 3, 5, 6, 8, 10])
def test_a_layer_that_comes_to_lie_elsewhere_while_it_moves_is_no_drift(seed: int) -> None:
    """Centimetres, in motion of a tenth of the strongest. Without the wandering they are of 3 to 21 deviations."""
    moved, relative, _ = yielding_layer(seed, 0.15)
    for known in (relative, None):
        found = transducer_drift(moved, RATE, known)
        assert found is None or found.certainty < 4 or found.share < 0.004


@pytest.mark.parametrize("seed", [0, 3, 5])
def test_a_drift_is_told_from_a_layer_that_wanders(seed: int) -> None:
    """By the stretches in which the accelerations are noise: 10 s before, 30 s after."""
    moved, relative, _ = yielding_layer(seed, 0.0)
    drift = 0.1 * np.abs(moved).max() * np.arange(moved.size) / moved.size
    found = transducer_drift(moved + drift, RATE, relative)
    assert found is not None
    assert found.certainty > 4
    assert found.share > 0.004
    sound = transducer_drift(moved, RATE, relative)
    assert sound is None or sound.certainty < 4 or sound.share < 0.004


def test_the_first_long_wave_of_an_earthquake_is_no_drift() -> None:
    """It moves a layer by 4 mm from the first block to the second, hardly oscillating: the acceleration says so."""
    rng, later = np.random.default_rng(1), TIME - 17
    long_wave = -0.0045 / (1 + np.exp(-(TIME - 5.2) / 0.1)) * (1 + np.tanh(-(TIME - 13) / 2)) / 2
    moved = motion(0.1, 0.0, 1) * (later > -5) + long_wave
    relative = np.gradient(np.gradient(long_wave)) * RATE**2 + 2.0 * rng.standard_normal(TIME.size) * (
        np.exp(-((later / 5) ** 2)) * (later > -5)
    )
    relative += 0.003 * rng.standard_normal(TIME.size)
    alone, compared = transducer_drift(moved, RATE), transducer_drift(moved, RATE, relative)
    assert alone is not None
    assert alone.certainty > 4
    assert compared is None or compared.certainty < 4
