"""The monitoring server, through a real socket by ObsPy's own client and by plain HTTP."""

from collections.abc import Iterator
from datetime import UTC, datetime

import httpx
import numpy as np
import pytest
from obspy import Trace, UTCDateTime
from obspy.clients.fdsn import Client
from obspy.clients.fdsn.header import FDSNNoDataException

from service.demo.earthquakes import Earthquake, quakeml
from service.demo.server import Archive, application, free_port, listening
from service.demo.site import LATITUDE, LONGITUDE, inventory, sensors

START = UTCDateTime(2024, 5, 1, 12)
EARTHQUAKE = Earthquake(0, datetime(2024, 5, 1, 12, tzinfo=UTC), "any", 1.0, 5e4)


def counts(seed: int, start: UTCDateTime = START) -> list[Trace]:
    rng = np.random.default_rng(seed)
    codes = [dict(zip(("network", "station", "location", "channel"), s.id.split("."), strict=True)) for s in sensors()]
    return [
        Trace(rng.integers(-(2**20), 2**20, 500, dtype=np.int32), {**code, "sampling_rate": 100.0, "starttime": start})
        for code in codes
    ]


@pytest.fixture(scope="module")
def archive() -> Archive:
    return Archive(inventory(), counts(1), [quakeml(EARTHQUAKE, LATITUDE, LONGITUDE)])


@pytest.fixture(scope="module")
def address(archive: Archive) -> Iterator[str]:
    with listening(application(archive)) as address:
        yield address


def test_obspys_client_reads_every_count(address: str, archive: Archive) -> None:
    read = Client(address).get_waveforms("XX", "DEMO", "*", "*", START, START + 10)
    assert len(read) == len(counts(1))
    for trace in counts(1):
        [same] = read.select(id=trace.id)
        assert np.array_equal(same.data, trace.data)
        assert same.stats.mseed.encoding == "STEIM2"


def test_obspys_client_reads_many_selections_at_once(address: str) -> None:
    wanted = [("XX", "DEMO", "01", "HYX", START, START + 1), ("XX", "DEMO", "00", "HN?", START, START + 2)]
    read = Client(address).get_waveforms_bulk(wanted)
    assert {(trace.id, trace.stats.npts) for trace in read} == {
        ("XX.DEMO.01.HYX", 101),
        ("XX.DEMO.00.HNX", 201),
        ("XX.DEMO.00.HNY", 201),
    }


def test_obspys_client_reads_gains_and_units(address: str) -> None:
    stations = Client(address).get_stations(channel="H?X", level="response")
    for sensor in (sensor for sensor in sensors() if sensor.direction == "x"):
        sensitivity = stations.get_response(sensor.id, START).instrument_sensitivity
        assert 1.0 / sensitivity.value == pytest.approx(sensor.resolution)
        assert sensitivity.input_units == {"acceleration": "M/S**2", "displacement": "M"}[sensor.quantity]
    assert not stations.select(channel="H?Y").networks


def test_obspys_client_reads_earthquakes(address: str) -> None:
    client = Client(address)
    [event] = client.get_events(starttime=START - 60, endtime=START)
    assert 0 < START - event.preferred_origin().time < 30  # s that a wave from within 150 km is on its way
    with pytest.raises(FDSNNoDataException):
        client.get_events(starttime=START, endtime=START + 60)


def test_what_is_added_is_served(address: str, archive: Archive) -> None:
    later = START + 86400
    assert httpx.get(f"{address}/fdsnws/dataselect/1/query", params={"start": str(later)}).status_code == 204
    archive.add(counts(2, later), quakeml(EARTHQUAKE, LATITUDE, LONGITUDE))
    assert len(Client(address).get_waveforms("XX", "DEMO", "*", "*", later, later + 10)) == len(counts(2))


@pytest.mark.parametrize(
    ("query", "status", "printed"),
    [
        ("dataselect/1/query?net=ZZ", 204, ""),
        ("dataselect/1/query?net=ZZ&nodata=404", 404, ""),
        ("dataselect/1/query?colour=red", 400, "no parameter colour"),
        ("dataselect/1/query?start=soon", 400, "'soon' is not a time"),
        ("dataselect/1/query?start=2024-02-01&end=2024-01-01", 400, "lies after"),
        ("station/1/query?minlatitude=30", 400, "does not select by minlatitude"),
        ("station/1/query?level=channel&format=text", 200, "XX|DEMO|00|HNX"),
        ("event/1/query?orderby=magnitude", 400, "ordered by time"),
        ("station/1/version", 200, "1.2.0"),
    ],
)
def test_answers_as_the_specification_has_them(address: str, query: str, status: int, printed: str) -> None:
    answer = httpx.get(f"{address}/fdsnws/{query}")
    assert answer.status_code == status
    assert printed in answer.text


def test_a_taken_port_is_passed_over(address: str) -> None:
    taken = int(address.rpartition(":")[2])
    assert free_port(taken) != taken
