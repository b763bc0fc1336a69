from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from building_files import SMALL
from record_files import CHANNEL, START, logger_counts, record_file, stationxml

from service.buildings import description
from service.buildings.description import BuildingFile
from service.formats import FormatError
from service.records.event_files import events

WITHOUT_GAIN = SMALL.replace('gain = -0.25\nunit = "gal"\n', "")
GAIN = 1e-6
STATION = stationxml(("01", 1 / GAIN, "M/S**2"))


@pytest.fixture
def building(tmp_path: Path) -> BuildingFile:
    """It names the folder `records` beside its file as its source, and no gain."""
    (tmp_path / "records").mkdir()
    return description.read(WITHOUT_GAIN, tmp_path)


def kept(folder: Path, **files: bytes) -> list[Path]:
    folder.mkdir(exist_ok=True)
    paths = [folder / name.replace("_", ".") for name in files]
    for path, data in zip(paths, files.values(), strict=True):
        path.write_bytes(data)
    return paths


@pytest.mark.parametrize("place", ["named", "beside", "source"])
def test_stationxml_is_detected_where_it_lies(place: str, building: BuildingFile, tmp_path: Path) -> None:
    samples = logger_counts(500)
    paths = kept(tmp_path / "event", a_mseed=record_file("MSEED", samples))
    where = {"named": tmp_path / "elsewhere", "beside": tmp_path / "event", "source": tmp_path / "records"}[place]
    station = kept(where, station_xml=STATION)
    (event,) = events([*paths, *station] if place == "named" else paths, building)
    (segment,) = event.segments
    assert (segment.channel, segment.start, segment.rate) == (CHANNEL, START, 100.0)
    assert segment.samples == pytest.approx(samples * GAIN, rel=1e-12)


def test_the_building_files_gain_goes_before_stationxml(tmp_path: Path) -> None:
    samples = logger_counts(100) // 1000
    paths = kept(tmp_path, a_mseed=record_file("MSEED", samples), station_xml=STATION)
    (event,) = events(paths, description.read(SMALL, tmp_path))
    assert event.segments[0].samples == pytest.approx(samples * -0.0025, rel=1e-12)


def test_a_named_stationxml_goes_before_one_that_lies_about(building: BuildingFile, tmp_path: Path) -> None:
    kept(tmp_path / "records", station_xml=stationxml(("01", 1.0, "M/S**2")))
    paths = kept(tmp_path / "event", a_mseed=record_file("MSEED", logger_counts(100)))
    (event,) = events([*paths, *kept(tmp_path / "named", station_xml=STATION)], building)
    assert event.segments[0].samples == pytest.approx(logger_counts(100) * GAIN, rel=1e-12)


def test_without_any_unit_the_channel_is_named(building: BuildingFile, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=CHANNEL):
        events(kept(tmp_path / "event", a_mseed=record_file("MSEED", logger_counts(100))), building)


def test_strangers_without_a_unit_are_no_harm(building: BuildingFile, tmp_path: Path) -> None:
    both = record_file("MSEED", logger_counts(100)) + record_file(
        "MSEED", logger_counts(100), channel="ZZ.OTHER.00.LOG"
    )
    (event,) = events(kept(tmp_path / "event", a_mseed=both, station_xml=STATION), building)
    assert [segment.channel for segment in event.segments] == [CHANNEL]


def test_the_same_file_twice_is_read_once(building: BuildingFile, tmp_path: Path) -> None:
    data = record_file("MSEED", logger_counts(100))
    (event,) = events(kept(tmp_path / "event", a_mseed=data, b_mseed=data, station_xml=STATION), building)
    assert len(event.segments) == 1


@pytest.mark.parametrize(("outage", "count"), [(30.0, 1), (300.0, 2)])
def test_a_short_outage_stays_within_its_event(
    outage: float, count: int, building: BuildingFile, tmp_path: Path
) -> None:
    data = record_file("MSEED", logger_counts(500), logger_counts(500), gap=outage)
    found = events(kept(tmp_path / "event", a_mseed=data, station_xml=STATION), building)
    assert len(found) == count
    assert sum(len(event.segments) for event in found) == 2
    assert found[-1].segments[-1].start - START == timedelta(seconds=5 + outage)


def test_a_wrong_unit_is_refused_with_the_file(building: BuildingFile, tmp_path: Path) -> None:
    station = stationxml(("01", 1.0, "M"))
    paths = kept(tmp_path / "event", a_mseed=record_file("MSEED", logger_counts(100)), station_xml=station)
    with pytest.raises(FormatError, match=r"a\.mseed: XX\.TOWER\.01\.HNX measures acceleration according to .* displ"):
        events(paths, building)


def test_counts_that_pass_for_si_are_refused(building: BuildingFile, tmp_path: Path) -> None:
    station = stationxml(("01", 1.0, "M/S**2"))
    paths = kept(tmp_path / "event", a_mseed=record_file("MSEED", logger_counts(1000)), station_xml=station)
    with pytest.raises(FormatError, match="which no building does"):
        events(paths, building)


def test_only_stationxml_makes_no_event(building: BuildingFile, tmp_path: Path) -> None:
    assert events(kept(tmp_path / "event", station_xml=STATION), building) == ()


def test_numbers_are_read_as_they_were_recorded(building: BuildingFile, tmp_path: Path) -> None:
    quiet = np.zeros(50, dtype=np.int32)
    (event,) = events(kept(tmp_path / "event", a_mseed=record_file("MSEED", quiet), station_xml=STATION), building)
    assert not event.segments[0].samples.any()
