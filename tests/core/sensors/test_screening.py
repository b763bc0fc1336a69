"""Every kind of fault is reported at its channel, with its severity; healthy records have none."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from building_models import BASE, FOURTH, GROUND, LAYER, ROOF, bncs, bncs_segments, paper, records, segments
from ground_motions import akt013, chi_chi, kobe
from shared_data import needs_shared

from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.arrays import Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.estimators.superstructure import instrumented_superstructure
from core.isolation_layer.layer import layer_motion
from core.record import Finding, Segment
from core.sensors.layer_agreement import recorded_agreement
from core.sensors.preparation import prepared
from core.sensors.reconciliation import reconciled
from core.sensors.screening import clipped_samples

CHANNELS = (GROUND, BASE, FOURTH, ROOF, LAYER)
Fault = Callable[[Vector], Vector]


STATIC = AnalysisSettings(estimator="cms")
"""Sensors are judged before forces are estimated: the findings of the screening do not depend on the estimator, and
this one takes half the time."""


def analysed(samples: dict[str, Vector]) -> EventAnalysis:
    return analyse(segments(samples), paper(), STATIC)


def screened(pieces: Sequence[Segment], description: BuildingDescription) -> list[Finding]:
    """Findings of an analysis but for those of the force, without the estimate of one."""
    preparation = prepared(pieces, description, STATIC.rate)
    assert preparation.record is not None
    levels = reconciled(preparation.record, description)
    findings = [*preparation.findings, *levels.findings]
    for direction in description.horizontal_directions:
        agreement = recorded_agreement(levels.record, description, direction)
        with suppress(RecordError):  # a direction without its base slab is left out
            instrumented_superstructure(levels.record, description, direction, STATIC.sensors, STATIC.band)
            findings += layer_motion(levels.record, description, direction, STATIC.integral, agreement)[1]
    return findings


@cache
def healthy_force() -> Vector:
    return analysed(records(3)).directions["x"].restoring_force.force


LATER = ("direction", "estimator")
"""Kinds of finding that follow from findings of the screening."""


def serious(findings: Iterable[Finding]) -> list[tuple[str, str, str | None]]:
    return [(f.kind, f.severity, f.channel) for f in findings if f.severity != "note" and f.kind not in LATER]


def spiked(samples: Vector) -> Vector:
    return samples + np.where(np.arange(samples.size) == 5000, 3 * np.abs(samples).max(), 0)


def gapped(samples: Vector) -> Vector:
    return np.where((np.arange(samples.size) >= 5000) & (np.arange(samples.size) < 5100), np.nan, samples)


def clipped(samples: Vector) -> Vector:
    limit = 0.5 * np.abs(samples).max()
    return samples.clip(-limit, limit)


UNUSABLE: dict[str, Fault] = {
    "dead": lambda samples: 0 * samples,
    "unit": lambda samples: 100 * samples,
    "reversed": lambda samples: -samples,
    "clipping": clipped,
    "gap": gapped,
}


@pytest.mark.accuracy
@pytest.mark.parametrize("noise", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("scale", [0.05, 1.0, 4.0])
@pytest.mark.parametrize("motion", [akt013, kobe, chi_chi])
def test_healthy_simulated_records_raise_no_alarm(motion: Callable[[], Vector], scale: float, noise: float) -> None:
    """core/isolation_layer/test_equivalent.py analyses those with noise to their end."""
    assert serious(screened(segments(records(1, noise, motion, scale)), paper())) == []


@pytest.mark.parametrize(("motion", "scale"), [(akt013, 0.05), (chi_chi, 1.0), (kobe, 4.0)])
def test_records_without_noise_are_analysed(motion: Callable[[], Vector], scale: float) -> None:
    """core/test_analysis.py analyses AKT013 at 70 gal."""
    result = analysed(records(1, 0.0, motion, scale))
    assert serious(result.quality) == []
    assert result.refusal is None


@needs_shared
@pytest.mark.parametrize("event", ["CNP100", "LAC100", "SP100"])
def test_healthy_real_records_raise_no_alarm(event: str) -> None:
    assert serious(screened(bncs_segments(event), bncs())) == []


@pytest.mark.accuracy
@pytest.mark.parametrize("channel", CHANNELS)
@pytest.mark.parametrize("kind", UNUSABLE)
def test_an_unusable_channel_is_named_and_refuses_the_event_if_it_is_the_base_slab(kind: str, channel: str) -> None:
    samples = records(2)
    samples[channel] = UNUSABLE[kind](samples[channel])
    result = analysed(samples)
    assert serious(result.quality) == [(kind, "fatal" if channel == BASE else "warning", channel)]
    assert (result.refusal is not None) == (channel == BASE) == (not result.directions)


def test_a_dead_channel_is_reported_to_have_one_value() -> None:
    samples = records(2)
    samples[ROOF] = 0 * samples[ROOF] + 0.25
    (message,) = [finding.message for finding in analysed(samples).quality if finding.kind == "dead"]
    assert message.startswith("every sample is 0.25 (SI)")


@pytest.mark.parametrize("channel", CHANNELS)
def test_a_spike_is_mended_with_a_warning(channel: str) -> None:
    samples = records(3)
    samples[channel] = spiked(samples[channel])
    result = analysed(samples)
    assert serious(result.quality) == [("spike", "warning", channel)]
    there, here = healthy_force(), result.directions["x"].restoring_force.force
    assert np.abs(here - there).max() < 0.02 * np.abs(there).max()  # what a straight line through one sample misses


@pytest.mark.parametrize("channel", CHANNELS)
def test_a_missing_channel_is_named(channel: str) -> None:
    samples = records(4)
    del samples[channel]
    result = analysed(samples)
    assert serious(result.quality) == [("missing", "fatal" if channel == BASE else "warning", channel)]
    assert (result.refusal is not None) == (channel == BASE)


@pytest.mark.parametrize(
    ("one", "other"),
    [(GROUND, BASE), (GROUND, FOURTH), (GROUND, ROOF), (BASE, FOURTH), (BASE, ROOF), (FOURTH, ROOF)],
)
def test_two_swapped_channels_are_both_named(one: str, other: str) -> None:
    samples = records(5)
    samples[one], samples[other] = samples[other], samples[one]
    findings = serious(screened(segments(samples), paper()))
    assert {(kind, channel) for kind, _, channel in findings} == {("swapped", one), ("swapped", other)}
    assert ("swapped", "fatal", BASE) in findings or BASE not in (one, other)


@pytest.mark.parametrize("channel", [GROUND, BASE, FOURTH, ROOF, LAYER])
def test_a_late_clock_is_measured(channel: str) -> None:
    samples = records(6)
    samples[channel] = np.roll(samples[channel], 6)
    findings = screened(segments(samples), paper())
    assert serious(findings) == [("delay", "warning", channel)]
    [late] = [finding.value for finding in findings if finding.kind == "delay"]
    assert late == pytest.approx(0.06, abs=0.007)  # the damping's own share on a real building


@pytest.mark.parametrize("channel", [GROUND, BASE, FOURTH, ROOF, LAYER])
def test_a_clock_that_jumps_in_the_strong_phase_is_detected(channel: str) -> None:
    samples = records(7)
    jump = 4500
    samples[channel] = np.concatenate([samples[channel][:jump], np.roll(samples[channel], 15)[jump:]])
    assert ("clock", "warning", channel) in serious(screened(segments(samples), paper()))


def test_a_short_gap_is_mended_with_a_note() -> None:
    samples = records(8)
    samples[ROOF][5000:5002] = np.nan
    result = analysed(samples)
    assert [(f.kind, f.severity, f.channel) for f in result.quality] == [("gap", "note", ROOF)]


def two_directions() -> tuple[BuildingDescription, dict[str, Vector]]:
    """The paper's building in x under AKT013 and in y under Kobe."""
    along = paper()
    across = tuple(replace(channel, id=channel.id[:-1] + "Y", direction="y") for channel in along.channels[:4])
    samples = records(9) | {
        f"{name[:-1]}Y": values for name, values in records(10, motion=kobe).items() if name != LAYER
    }
    return replace(along, channels=along.channels + across), samples


def test_a_healthy_building_of_two_directions_raises_no_alarm() -> None:
    description, samples = two_directions()
    result = analyse(segments(samples), description, AnalysisSettings())
    assert serious(result.quality) == []
    assert set(result.directions) == {"x", "y"}


@pytest.mark.parametrize("channel", [BASE, FOURTH, ROOF])
def test_a_sensor_whose_directions_are_swapped_is_named(channel: str) -> None:
    description, samples = two_directions()
    other = f"{channel[:-1]}Y"
    samples[channel], samples[other] = samples[other], samples[channel]
    findings = serious(screened(segments(samples), description))
    assert {(kind, name) for kind, _, name in findings} == {("swapped", channel), ("swapped", other)}


@needs_shared
@pytest.mark.parametrize(("one", "other"), [("02", "03"), ("05", "06"), ("00", "01"), ("01", "02")])
def test_two_swapped_channels_of_the_real_building_are_named(one: str, other: str) -> None:
    names = {f"XX.BNCS.{one}.HNX": f"XX.BNCS.{other}.HNX", f"XX.BNCS.{other}.HNX": f"XX.BNCS.{one}.HNX"}
    pieces = [replace(piece, channel=names.get(piece.channel, piece.channel)) for piece in bncs_segments("LAC100")]
    findings = serious(screened(pieces, bncs()))
    assert {channel for kind, _, channel in findings if kind == "swapped"} & set(names)


RATE = 100.0
STEP = 1e-5


def motion(seed: int, frequency: float, amplitude: float) -> Vector:
    """One frequency whose amplitude waxes and wanes, so that few peaks are alike."""
    rng = np.random.default_rng(seed)
    time = np.arange(6000) / RATE
    growth = 1 + 0.5 * np.sin(2 * np.pi * time / 40 + rng.uniform(0, 6))
    swing = growth * np.sin(2 * np.pi * frequency * time + rng.uniform(0, 6))
    return np.asarray(amplitude * swing / np.abs(swing).max())


@pytest.mark.parametrize("amplitude", [0.001, 0.004, 0.08])
@pytest.mark.parametrize("frequency", [0.25, 0.5, 1.0])
def test_a_coarse_peak_is_not_clipped(frequency: float, amplitude: float) -> None:
    for seed in range(20):
        rng = np.random.default_rng(seed)
        exact = motion(seed, frequency, amplitude)
        for noise in (0.0, STEP):
            coarse = np.round((exact + noise * rng.standard_normal(exact.size)) / STEP) * STEP
            assert clipped_samples(coarse) == 0


@pytest.mark.parametrize("step", [1e-9, STEP])
@pytest.mark.parametrize("limit", [0.5, 0.8])
@pytest.mark.parametrize("frequency", [0.5, 1.0, 4.0])
def test_what_a_limit_cuts_is_counted(frequency: float, limit: float, step: float) -> None:
    for seed in range(10):
        exact = motion(seed, frequency, 0.02)
        cut = np.round(np.clip(exact, -limit * 0.02, limit * 0.02) / step) * step
        at_limit = np.abs(cut) >= np.abs(cut).max() - step / 2
        assert clipped_samples(cut) == at_limit.sum()


def test_a_channel_without_motion_is_not_clipped() -> None:
    assert clipped_samples(np.zeros(100)) == 0
