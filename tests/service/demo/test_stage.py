"""The simulated world: its catalogue, its records, and that it is the same every time."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from obspy import Trace, UTCDateTime, read, read_inventory

from core.building import ShearBuilding
from core.paper import BUILDING as PAPER
from service.buildings import description
from service.demo.earthquakes import (
    APART,
    STRONG,
    WEAK,
    YEARS,
    GroundMotion,
    history,
    natural,
    peak_accelerations,
    prepared,
    recorded,
    weak_then_strong,
)
from service.demo.scenario import BY_DESIGN, HIDDEN_EFFECT, Scenario
from service.demo.site import LATITUDE, building_file as written, sensors
from service.demo.stage import BETWEEN_RECORDS, Stage, forget, prepared as staged, until_next, write_records
from service.records.fdsn_query import Selection

NOW = datetime(2026, 1, 1, tzinfo=UTC)
COUNT = 3


def motions() -> tuple[GroundMotion, ...]:
    """Two made-up motions, so that these tests need not read the recorded ones."""
    rng = np.random.default_rng(7)
    return tuple(GroundMotion(name, 100.0, rng.standard_normal((2, 1000))) for name in ("one", "another"))


def stage(folder: Path, now: datetime = NOW, scenario: Scenario = BY_DESIGN) -> Stage:
    return staged(folder, scenario, motions(), COUNT, now, lambda done, of: None)


def samples(stage: Stage) -> list[tuple[str, str, bytes]]:
    return [(t.id, str(t.stats.starttime), t.data.tobytes()) for t in stage.archive.waveforms(Selection())]


def samples_of(stage: Stage, arrival: datetime) -> list[Trace]:
    start = UTCDateTime(arrival)
    return list(stage.archive.waveforms(Selection(start=start, end=start + 30)))


def test_many_small_and_few_large_earthquakes() -> None:
    peaks = peak_accelerations(32)
    assert peaks[[0, -1]] == pytest.approx([0.05, 3.0])
    assert (np.diff(peaks) > 0).all()
    for level in (0.1, 0.3, 1.0):  # m/s²: the number above a falls as 1/a, up to half an earthquake of rounding
        expected = 31 * (1 / level - 1 / 3.0) / (1 / 0.05 - 1 / 3.0)
        assert np.sum(peaks > level) == pytest.approx(expected, abs=1.0)


def test_the_past_lies_in_the_past_and_its_earthquakes_apart() -> None:
    past = history(NOW, 32, natural, ["one", "another"], np.random.default_rng(1))
    arrivals = [earthquake.arrival for earthquake in past]
    assert NOW - YEARS <= arrivals[0] <= arrivals[-1] < NOW
    assert min(np.diff(arrivals)) >= APART
    assert {earthquake.motion for earthquake in past} == {"one", "another"}
    assert max(past, key=lambda earthquake: earthquake.peak) in past[:8], "the strongest is early"
    assert sorted(earthquake.peak for earthquake in past) == pytest.approx(peak_accelerations(32))


def test_a_layer_is_moved_far_only_in_the_second_half() -> None:
    past = history(NOW, 7, weak_then_strong, ["one", "another"], np.random.default_rng(1))
    assert max(earthquake.peak for earthquake in past[:4]) == pytest.approx(WEAK[1])
    assert min(earthquake.peak for earthquake in past[4:]) == pytest.approx(STRONG[0])


def test_a_second_start_is_the_first_one_continued(tmp_path: Path) -> None:
    first = stage(tmp_path)
    fresh = first.strike(NOW + timedelta(hours=1))
    second = stage(tmp_path, NOW + timedelta(days=5))
    assert second.earthquakes == (*first.earthquakes[:COUNT], fresh)
    assert samples(second) == samples(first)


def test_what_is_forgotten_happens_otherwise_only_in_time(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    first = stage(tmp_path)
    write_records(first)
    forget(tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["notes.txt"]
    later = stage(tmp_path, NOW + timedelta(days=1))
    assert [e.arrival for e in later.earthquakes] == [e.arrival + timedelta(days=1) for e in first.earthquakes]


def test_records_as_files_are_what_the_server_holds(tmp_path: Path) -> None:
    started = stage(tmp_path)
    folder = write_records(started)
    written = [read(folder / f"{number}.mseed") for number in range(1, COUNT + 1)]
    assert sorted((t.id, str(t.stats.starttime), t.data.tobytes()) for stream in written for t in stream) == sorted(
        samples(started)
    )
    assert (
        read_inventory(folder / "station.xml").get_contents()["channels"]
        == started.archive.inventory.get_contents()["channels"]
    )


def test_the_next_earthquake_waits_until_records_no_longer_overlap(tmp_path: Path) -> None:
    now = NOW + timedelta(hours=1)
    started = stage(tmp_path)
    fresh = started.strike(now)
    wanted = timedelta(seconds=60)
    wait = until_next(started.earthquakes, now, wanted)
    assert started.strike(now + wait).arrival - fresh.arrival >= BETWEEN_RECORDS
    assert until_next(started.earthquakes, now + timedelta(days=1), wanted) == wanted


def test_records_hold_the_peak_that_the_catalogue_promises(tmp_path: Path) -> None:
    started = stage(tmp_path)
    resolution = {sensor.id: sensor.resolution for sensor in sensors()}
    noise = 6e-4  # m/s²: six standard deviations of the sensors'
    for earthquake in started.earthquakes:
        ground = [t for t in samples_of(started, earthquake.arrival) if t.stats.location == "00"]
        peak = max(np.abs(t.data - np.median(t.data)).max() * resolution[t.id] for t in ground)
        assert peak == pytest.approx(earthquake.peak, abs=noise)


def test_the_building_file_describes_the_papers_building(tmp_path: Path) -> None:
    described = description.read(written("http://127.0.0.1:1"), tmp_path)
    floors = described.description
    same = ShearBuilding(floors.base_mass, floors.floor_mass, floors.storey_stiffness, PAPER.damping_coefficient)
    assert same.total_mass == pytest.approx(PAPER.total_mass)
    assert same.storey_stiffness == pytest.approx(PAPER.storey_stiffness)
    assert [channel.id for channel in floors.channels] == [sensor.id for sensor in sensors()]
    assert described.latitude == LATITUDE


def test_a_prepared_motion_begins_and_ends_at_rest() -> None:
    motion = motions()[0]
    shaking = prepared(motion, 200.0, before=15.0, after=45.0)
    assert shaking.shape == (2, 200 * (15 + 10 + 45))
    assert np.abs(shaking[:, :1000]).max() < 1e-2 * np.abs(shaking).max()
    assert np.abs(shaking[:, -1000:]).max() < 1e-2 * np.abs(shaking).max()


def test_recorded_motions_are_what_they_were() -> None:
    """Published peaks: FEMA P695 (2009), table A-4A, in g; K-NET's header of AKT013, in gal."""
    found = {motion.name: motion for motion in recorded()}
    assert len(found) >= 30
    assert len(HIDDEN_EFFECT.chosen(tuple(found.values()))) == len(HIDDEN_EFFECT.motions)
    published = {"Northridge 1994, Beverly Hills - Mulhol": 0.52, "Kobe, Japan 1995, Nishi-Akashi": 0.51}
    for name, peak in published.items():
        assert np.abs(found[name].acceleration).max() / 9.80665 == pytest.approx(peak, abs=0.005)  # two digits
    east = found["Akita 1996, AKT013"].acceleration[0] / 0.8
    assert np.abs(east - east.mean()).max() == pytest.approx(0.04383, rel=1e-3)
