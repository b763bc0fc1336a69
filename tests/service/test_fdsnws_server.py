"""ObsPy's own FDSN client, unchanged, reads what is stored from the running service."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from threading import Thread
from time import sleep

import httpx
import numpy as np
import obspy
import pytest
import uvicorn
from obspy.clients.fdsn import Client
from sqlalchemy.orm import Session, sessionmaker

from service import blobs, buildings
from service.app import create
from service.database import Event, Waveform
from service.settings import Settings

BUILDING = """
code = "TWR"
name = "Tower"
latitude = 35.5
longitude = 139.6
[[level]]
name = "ground"
role = "ground"
[[level]]
name = "base"
role = "base"
mass = 2e5
[[level]]
name = "roof"
mass = 1e5
[isolation]
[[channel]]
id = "XX.TWR.01.HNX"
level = "base"
direction = "x"
quantity = "acceleration"
[[channel]]
id = "XX.TWR.02.HNX"
level = "roof"
direction = "x"
quantity = "acceleration"
"""
START = datetime(2011, 3, 11, 5, 46, 24, tzinfo=UTC)
RATE, GAIN = 100.0, 2e-6
COUNTS = np.random.default_rng(11).integers(-(2**20), 2**20, 6000).astype(np.int32)


@contextmanager
def served(url: str) -> Iterator[str]:
    """Address of the service on loopback."""
    server = uvicorn.Server(uvicorn.Config(create(Settings(database_url=url)), port=0, log_level="error"))
    thread = Thread(target=server.run)
    thread.start()
    while not server.started:
        sleep(0.01)
    port = server.servers[0].sockets[0].getsockname()[1]
    try:
        yield f"http://127.0.0.1:{port}"
    finally:
        server.should_exit = True
        thread.join()


@pytest.fixture
def address(database_url: str, sessions: sessionmaker[Session]) -> Iterator[str]:
    with sessions.begin() as session:
        building = buildings.add(session, BUILDING, Path("."), START)
        event = Event(
            building=building,
            start=START,
            end=datetime(2011, 3, 11, 5, 47, 24, tzinfo=UTC),
            state="queued",
            created_at=START,
            updated_at=START,
        )
        for channel in ("XX.TWR.01.HNX", "XX.TWR.02.HNX"):
            event.waveforms.append(
                Waveform(
                    channel=channel, start=START, rate=RATE, count=COUNTS.size, gain=GAIN, samples=blobs.encode(COUNTS)
                )
            )
        session.add(event)
    with served(database_url) as found:
        yield found


def test_obspys_client_reads_a_stored_event(address: str) -> None:
    client = Client(base_url=address)
    start = obspy.UTCDateTime(START)
    inventory = client.get_stations(network="XX", station="TWR", level="response")
    stream = client.get_waveforms("XX", "TWR", "*", "HN?", start - 10, start + 100)
    assert [trace.id for trace in stream] == ["XX.TWR.01.HNX", "XX.TWR.02.HNX"]
    np.testing.assert_array_equal(stream[0].data, COUNTS)
    assert abs(stream[0].stats.starttime - start) < 1e-6  # miniSEED's own resolution
    sensitivity = inventory.get_response("XX.TWR.01.HNX", start + 1).instrument_sensitivity
    assert sensitivity.value == pytest.approx(1 / GAIN, rel=1e-9)  # digits of the XML
    assert sensitivity.input_units.lower() == "m/s**2"


def test_a_part_is_cut_out_and_posted_selections_work(address: str) -> None:
    client = Client(base_url=address)
    start = obspy.UTCDateTime(START)
    stream = client.get_waveforms_bulk([("XX", "TWR", "02", "HNX", start + 10, start + 20)])
    np.testing.assert_array_equal(stream[0].data, COUNTS[1000:2001])


@pytest.mark.parametrize(("nodata", "status"), [("204", 204), ("404", 404)])
def test_nothing_stored_is_answered_as_asked(address: str, nodata: str, status: int) -> None:
    for service in ("station", "dataselect"):
        answer = httpx.get(f"{address}/fdsnws/{service}/1/query", params={"network": "ZZ", "nodata": nodata})
        assert answer.status_code == status


@pytest.mark.parametrize(
    "query", ["starttime=yesterday", "colour=red", "level=brick", "starttime=2012-01-01&endtime=2011-01-01"]
)
def test_a_wrong_question_is_told_so_in_the_specifications_words(address: str, query: str) -> None:
    answer = httpx.get(f"{address}/fdsnws/station/1/query?{query}")
    assert answer.status_code == 400
    assert answer.text.startswith("Error 400: ")
