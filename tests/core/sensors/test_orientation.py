from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from biaxial_records import biaxial_records, record_of, turned
from building_models import segments
from ground_motions import RATE, akt013, chi_chi, kobe
from hypothesis import given, settings, strategies as st
from scipy import signal

from core.analysis import AnalysisSettings, analyse
from core.arrays import Vector
from core.sensors.orientation import along_described_axes, oriented, relative_angle, turned_back


def filtered(samples: np.ndarray, frequency: float) -> np.ndarray:
    """A resonant level: another transfer function for each frequency."""
    return np.asarray(signal.lfilter(*signal.butter(2, [0.5 * frequency, 2 * frequency], "bandpass", fs=RATE), samples))


REFERENCE = np.array([akt013(), kobe()])
LEVEL = np.array([filtered(REFERENCE[0], 0.5), filtered(REFERENCE[1], 0.7)])


@settings(deadline=None, max_examples=30)
@given(degrees=st.floats(-85, 85))
def test_the_angle_is_detected_whatever_the_two_transfer_functions(degrees: float) -> None:
    angle = relative_angle(REFERENCE, turned_back(LEVEL, -np.deg2rad(degrees)), RATE)
    assert angle is not None
    # transfer functions are no steps: what they change within eight bins is left
    assert np.rad2deg(angle.angle) == pytest.approx(degrees, abs=1.0)
    assert abs(np.rad2deg(angle.angle) - degrees) < 4 * np.rad2deg(angle.std)


def test_turning_back_undoes_a_turn() -> None:
    assert turned_back(turned_back(REFERENCE, 0.3), -0.3) == pytest.approx(REFERENCE)
    # axes turned by 90 degrees from x towards y read the building's y in x, and its −x in y
    x, y = turned_back(np.array([[0.0], [-1.0]]), np.pi / 2)
    assert (x[0], y[0]) == (pytest.approx(1.0), pytest.approx(0.0))


def test_the_standard_deviation_covers_the_angle_in_noise() -> None:
    """Measured: 40 of 40 within two standard deviations; their median is three times the error's."""
    rng, off = np.random.default_rng(1), []
    sensor = turned_back(LEVEL, -np.deg2rad(20.0))
    for _ in range(40):
        noise = 0.1 * sensor.std(axis=1, keepdims=True) * rng.standard_normal(sensor.shape)
        angle = relative_angle(REFERENCE, sensor + noise, RATE)
        assert angle is not None
        off.append((np.rad2deg(angle.angle) - 20.0) / np.rad2deg(angle.std))
    assert np.mean(np.abs(off) < 2) > 0.9


def test_motion_along_one_line_shows_no_angle() -> None:
    line = np.array([akt013(), 0.6 * akt013()])
    noise = 0.01 * np.random.default_rng(2).standard_normal((2, *line.shape)) * line.std()
    angle = relative_angle(line + noise[0], line + noise[1], RATE)
    assert angle is None or np.rad2deg(angle.std) > 3.0


def test_what_does_not_belong_together_has_no_angle() -> None:
    assert relative_angle(REFERENCE, np.array([chi_chi(), chi_chi()[::-1]]), RATE) is None
    assert relative_angle(REFERENCE[:, :500], REFERENCE[:, :500], RATE) is None
    assert relative_angle(REFERENCE, 0 * REFERENCE, RATE) is None


def test_the_signs_show_reversed_axes() -> None:
    angle = relative_angle(REFERENCE, REFERENCE * [[1.0], [-1.0]], RATE)
    assert angle is not None
    assert angle.signs == (1.0, -1.0)
    assert angle.angle == pytest.approx(0.0, abs=1e-6)


def test_a_sensor_at_the_corner_of_a_slab_that_turns_is_not_mistaken_for_turned() -> None:
    """Torsion with the motion in x adds a fifth of it to y and leaves x alone: no turn of the axes does so."""
    corner = np.array([LEVEL[0], LEVEL[1] + 0.2 * LEVEL[0]])
    assert relative_angle(REFERENCE, corner, RATE) is None


GROUND, BASE, FOURTH, ROOF = (f"XX.PAPER.{level}.HN" for level in ("00", "01", "04", "08"))
LAYER = "XX.PAPER.01.HY"
ANGLES = (-150.0, -45.0, 4.0, 10.0, 30.0, 90.0)


@pytest.mark.parametrize("degrees", ANGLES)
@pytest.mark.parametrize("sensor", [GROUND, BASE, FOURTH, ROOF, LAYER])
def test_turned_axes_are_detected_and_turned_back(sensor: str, degrees: float) -> None:
    """To 0.3 degrees; the base slab's axes follow from all others, the ground's from the displacement transducers."""
    description, samples = biaxial_records()
    record = record_of(description.channels, turned(samples, sensor, degrees))
    straight, findings = oriented(record, description)
    assert [(f.kind, f.severity, f.channel) for f in findings] == [
        ("rotation", "warning", f"{sensor}X"),
        ("rotation", "warning", f"{sensor}Y"),
    ]
    assert np.rad2deg(findings[0].value or 0.0) == pytest.approx(degrees, abs=0.3)
    assert f"rotation = {degrees:.0f}" in findings[0].message
    healthy = record_of(description.channels, samples)
    # an angle off by 0.3 degrees leaves half a per cent of the other direction's motion
    assert np.abs(straight.samples - healthy.samples).max() < 0.006 * np.abs(healthy.samples).max()


@pytest.mark.parametrize("noise", [0.1, 0.3])
@pytest.mark.parametrize("degrees", [-30.0, 10.0, 33.0])
@pytest.mark.parametrize(("along", "across"), [(akt013, kobe), (chi_chi, kobe), (kobe, akt013), (akt013, chi_chi)])
def test_no_other_sensor_is_taken_for_the_base_slabs_that_is_turned(
    along: Callable[[], Vector], across: Callable[[], Vector], degrees: float, noise: float
) -> None:
    """In noise, one floor may determine its angle and the other not, or neither: then nothing may be stated."""
    description, samples = biaxial_records(along, across, noise)
    record = record_of(description.channels, turned(samples, BASE, degrees))
    _, findings = oriented(record, description)
    assert {finding.channel for finding in findings} <= {f"{BASE}X", f"{BASE}Y"}
    if noise == 0.1:
        assert np.rad2deg(findings[0].value or 0.0) == pytest.approx(degrees, abs=2.0)


@pytest.mark.parametrize("degrees", [-45.0, 10.0, 30.0])
def test_without_transducers_the_ground_is_judged_across_the_layer(degrees: float) -> None:
    """Whose transfer function no one knows: to 2 degrees."""
    description, samples = biaxial_records()
    left = {name: values for name, values in turned(samples, GROUND, degrees).items() if not name.startswith(LAYER)}
    _, findings = oriented(record_of(description.channels, left), description)
    assert {finding.channel for finding in findings} == {f"{GROUND}X", f"{GROUND}Y"}
    assert np.rad2deg(findings[0].value or 0.0) == pytest.approx(degrees, abs=2.0)


def test_where_no_other_floor_is_measured_the_ground_shows_that_the_roofs_sensor_is_turned() -> None:
    description, samples = biaxial_records()
    left = {name: values for name, values in turned(samples, ROOF, 30.0).items() if not name.startswith(FOURTH)}
    _, findings = oriented(record_of(description.channels, left), description)
    assert {finding.channel for finding in findings} == {f"{ROOF}X", f"{ROOF}Y"}


@pytest.mark.parametrize("sensor", [BASE, ROOF])
def test_rotated_and_mirrored_axes_are_excluded(sensor: str) -> None:
    description, samples = biaxial_records()
    samples = turned(samples, sensor, 30.0)
    samples[f"{sensor}Y"] = -samples[f"{sensor}Y"]
    straight, findings = oriented(record_of(description.channels, samples), description)
    assert [finding.severity for finding in findings] == 2 * ["fatal" if sensor == BASE else "warning"]
    assert "mirrored" in findings[0].message
    assert np.rad2deg(findings[0].value or 0.0) == pytest.approx(30.0, abs=0.3)
    assert not {f"{sensor}X", f"{sensor}Y"} & {channel.id for channel in straight.channels}


@pytest.mark.parametrize("sensor", [BASE, FOURTH, ROOF])
def test_axes_that_are_only_exchanged_reversed_or_slightly_turned_are_no_rotation(sensor: str) -> None:
    description, samples = biaxial_records()
    x, y = samples[f"{sensor}X"], samples[f"{sensor}Y"]
    for changed in (
        {f"{sensor}X": y, f"{sensor}Y": x},
        {f"{sensor}X": -x},
        {f"{sensor}Y": -y},
        {f"{sensor}X": -x, f"{sensor}Y": -y},
        turned(samples, sensor, 2.0),
    ):
        record = record_of(description.channels, samples | changed)
        same, findings = oriented(record, description)
        assert findings == ()
        assert (same.samples == record.samples).all()


@pytest.mark.parametrize("noise", [0.01, 0.1])
@pytest.mark.parametrize("scale", [0.2, 1.0, 4.0])
@pytest.mark.parametrize(("along", "across"), [(akt013, kobe), (chi_chi, kobe), (chi_chi, akt013)])
def test_healthy_sensors_are_left_alone(
    along: Callable[[], Vector], across: Callable[[], Vector], scale: float, noise: float
) -> None:
    description, samples = biaxial_records(along, across, noise, scale)
    record = record_of(description.channels, samples)
    assert oriented(record, description)[1] == ()
    without = {name: values for name, values in samples.items() if not name.startswith(LAYER)}
    assert oriented(record_of(description.channels, without), description)[1] == ()


def test_the_building_file_turns_axes_for_good() -> None:
    description, samples = biaxial_records()
    channels = tuple(
        replace(channel, rotation=np.deg2rad(30.0)) if channel.id.startswith(ROOF) else channel
        for channel in description.channels
    )
    described = replace(description, channels=channels)
    record = record_of(channels, turned(samples, ROOF, 30.0))
    straight, findings = along_described_axes(record, described)
    assert findings == ()
    np.testing.assert_allclose(straight.samples, record_of(channels, samples).samples, rtol=1e-6, atol=1e-12)
    alone = {name: values for name, values in samples.items() if name != f"{ROOF}Y"}
    left, findings = along_described_axes(record_of(channels, alone), described)
    assert [(finding.kind, finding.channel) for finding in findings] == [("rotation", f"{ROOF}X")]
    assert f"{ROOF}X" not in {channel.id for channel in left.channels}


@pytest.mark.accuracy
def test_an_event_with_turned_axes_is_analysed_as_if_they_were_not() -> None:
    description, samples = biaxial_records()
    straight = analyse(segments(samples), description, AnalysisSettings())
    mended = analyse(segments(turned(samples, BASE, 30.0)), description, AnalysisSettings())
    assert {finding.kind for finding in mended.quality} == {"rotation"}
    for direction in ("x", "y"):
        expected = straight.directions[direction].restoring_force.force
        force = mended.directions[direction].restoring_force.force
        # an angle off by 0.1 degrees
        assert np.linalg.norm(force - expected) < 0.02 * np.linalg.norm(expected)
