"""A fault counts if it recurs; gains, clocks and drift are estimated from all records; each is reported in words."""

import numpy as np
import pytest
from building_models import BASE, GROUND, LAYER, ROOF, paper
from consistent_records import consistent_record, differences
from consistent_sensors import COUNT, RATE
from paper_records import START
from yielding_layer import yielding_layer

from core.analysis import EventAnalysis
from core.arrays import Vector
from core.diagnosis.sensor_faults import BuildingFault, Cause, sensor_faults
from core.record import Finding, Record

SOUND: dict[str, Vector] = {}


def analysis(record: Record | None, *quality: Finding) -> EventAnalysis:
    compared = {} if record is None else differences(record)
    return EventAnalysis(
        START, RATE, COUNT, {}, quality, {}, None, None, None, None, record=record, differences=compared
    )


def earthquakes(errors: dict[str, Vector], count: int = 2) -> list[EventAnalysis]:
    return [analysis(consistent_record(errors, 0.03, [7, number])) for number in range(count)]


def drifting(change: float, count: int) -> list[EventAnalysis]:
    """Earthquakes in which the transducer's level changes steadily, by so many metres."""
    quakes = earthquakes(SOUND, count)
    for quake in quakes:
        assert quake.record is not None
        row = [channel.id for channel in quake.record.channels].index(LAYER)
        quake.record.samples[row] += change * np.linspace(0, 1, COUNT)
    return quakes


def the_only(result: tuple[BuildingFault, ...]) -> BuildingFault:
    (suspect,) = result
    assert suspect.cause is Cause.SENSOR
    return suspect


def test_sound_sensors_are_not_suspected() -> None:
    assert sensor_faults(earthquakes(SOUND), paper()) == ()


@pytest.mark.parametrize(
    ("error", "kind", "value", "printed"),
    [
        ([np.log(1.12), 0.0, 0.0], "gain", 0.12, "too much"),
        ([np.log(0.9), 0.0, 0.0], "gain", -0.1, "too little"),
        ([0.0, 0.02, 0.0], "delay", 0.02, "late"),
        ([0.0, 0.0, -5e-4], "clock", -5e-4, "fast"),
    ],
)
def test_gains_and_clocks_are_reported_with_their_std(
    error: list[float], kind: str, value: float, printed: str
) -> None:
    """Four standard deviations of a value from two records."""
    suspect = the_only(sensor_faults(earthquakes({ROOF: np.array(error)}), paper()))
    assert (suspect.channel, suspect.kind) == (ROOF, kind)
    assert suspect.std is not None
    assert abs(suspect.value - value) < 4 * suspect.std
    assert printed in suspect.message


def test_a_gain_too_small_to_matter_is_passed_over() -> None:
    assert sensor_faults(earthquakes({ROOF: np.array([0.015, 0.0, 0.0])}), paper()) == ()


def test_a_drifting_transducer_is_reported() -> None:
    suspect = the_only(sensor_faults(drifting(0.02, 2), paper()))
    assert (suspect.channel, suspect.kind) == (LAYER, "drift")
    assert "mm while the building is at rest" in suspect.message


def test_a_drift_that_no_earthquake_shows_alone_is_certain_by_several() -> None:
    """Its changes at rest are of 1.4 to 3.2 standard deviations."""
    quakes = drifting(0.005, 4)
    assert all(sensor_faults([one], paper()) == () for one in quakes)
    assert the_only(sensor_faults(quakes, paper())).kind == "drift"


def test_a_layer_that_comes_to_lie_elsewhere_accuses_no_transducer() -> None:
    """Centimetres in motion of a tenth of the strongest, in each of four earthquakes."""
    quakes = []
    for seed in (3, 5, 6, 10):
        moved, relative, ground = yielding_layer(seed, 0.15)
        channels = tuple(one for name in (GROUND, BASE, LAYER) for one in paper().channels if one.id == name)
        quakes.append(analysis(Record(START, RATE, channels, np.array([ground, ground + relative, moved]))))
    assert sensor_faults(quakes, paper()) == ()


def test_a_fault_that_comes_again_in_half_of_the_earthquakes_is_the_sensors() -> None:
    clipped = Finding("clipping", "warning", "lies flat at 3 m/s²", ROOF, 3.0)
    sound = analysis(None)
    suspect = the_only(sensor_faults([analysis(None, clipped), sound], paper()))
    assert (suspect.kind, suspect.channel, suspect.value) == ("clipping", ROOF, 3.0)
    assert suspect.message == "in 1 of 2 earthquakes, as in this one: lies flat at 3 m/s²"
    assert sensor_faults([analysis(None, clipped), sound, sound], paper()) == ()


def test_earthquakes_without_the_channel_do_not_count() -> None:
    clipped = Finding("clipping", "warning", "lies flat", ROOF, 3.0)
    missing = Finding("missing", "warning", "was not recorded", ROOF)
    faults = sensor_faults([analysis(None, clipped), *[analysis(None, missing)] * 3], paper())
    assert the_only(faults).message.startswith("in 1 of 1 ")


def test_notes_are_no_faults() -> None:
    assert sensor_faults([analysis(None, Finding("offset", "note", "rests at 2 mm", LAYER, 0.002))], paper()) == ()


@pytest.mark.parametrize(
    ("kind", "found", "recorded", "is_fault"),
    [
        ("reversed", 1, 2, True),
        ("reversed", 2, 5, True),
        ("swapped", 2, 8, True),
        ("reversed", 1, 5, False),
        ("reversed", 2, 9, False),
        ("dead", 2, 5, False),
    ],
)
def test_wiring_that_weak_records_do_not_show_counts_in_fewer(
    kind: str, found: int, recorded: int, is_fault: bool
) -> None:
    finding = Finding(kind, "fault", "moves opposite to all others", ROOF)
    analyses = [analysis(None, finding)] * found + [analysis(None)] * (recorded - found)
    assert bool(sensor_faults(analyses, paper())) == is_fault
