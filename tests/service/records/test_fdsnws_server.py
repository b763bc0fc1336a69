"""ObsPy's own FDSN client, unchanged, reads what is stored from the running service."""

from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from time import monotonic

import httpx
import numpy as np
import obspy
import pytest
from api_server import api_server
from obspy.clients.fdsn import Client
from sqlalchemy import event as sqlalchemy_event
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db import blobs
from service.records.events import remember_channels
from service.records.fdsn import Level, inventory, miniseed
from service.records.fdsn_query import Selection
from service.records.tables import Event, Waveform

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


MOST = 3 * COUNTS.size


def stored(session: Session, building: Building, start: datetime, channels: dict[str, float]) -> None:
    """An event of a minute: the same counts of every channel, with its gain."""
    end = start + timedelta(minutes=1)
    event = Event(building=building, start=start, end=end, state="queued", created_at=start, updated_at=start)
    for channel, gain in channels.items():
        event.waveforms.append(
            Waveform(
                channel=channel, start=start, rate=RATE, count=COUNTS.size, gain=gain, samples=blobs.encode(COUNTS)
            )
        )
    session.add(event)
    session.flush()
    remember_channels(session, building.id, event.waveforms)


@pytest.fixture
def address(database_url: str, sessions: sessionmaker[Session]) -> Iterator[str]:
    with sessions.begin() as session:
        building = building_store.add(session, BUILDING, Path("."), START)
        stored(session, building, START, dict.fromkeys(("XX.TWR.01.HNX", "XX.TWR.02.HNX"), GAIN))
    with api_server(database_url, max_dataselect_samples=MOST) as found:
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
def test_nothing_stored_is_answered_as_requested(address: str, nodata: str, status: int) -> None:
    for service in ("station", "dataselect"):
        answer = httpx.get(f"{address}/fdsnws/{service}/1/query", params={"network": "ZZ", "nodata": nodata})
        assert answer.status_code == status


@pytest.mark.parametrize(
    "query",
    [
        "starttime=yesterday",
        "colour=red",
        "latitude=35&longitude=139&maxradius=1",
        "minlatitude=north",
        "maxlongitude=181",
        "level=brick",
        "starttime=2012-01-01&endtime=2011-01-01",
    ],
)
def test_a_wrong_question_is_reported_so_in_the_specifications_words(address: str, query: str) -> None:
    answer = httpx.get(f"{address}/fdsnws/station/1/query?{query}")
    assert answer.status_code == 400
    assert answer.text.startswith("Error 400: ")


@pytest.mark.parametrize(
    ("limits", "status"),
    [("minlat=35&maxlat=36", 200), ("minlongitude=139.6", 200), ("maxlatitude=35.4", 204), ("minlon=140", 204)],
)
def test_stations_are_detected_by_where_they_stand(address: str, limits: str, status: int) -> None:
    assert httpx.get(f"{address}/fdsnws/station/1/query?{limits}").status_code == status


def test_stations_are_requested_by_post(address: str) -> None:
    client = Client(base_url=address)
    start = obspy.UTCDateTime(START)
    bulk = [("XX", "TWR", "02", "HN?", start, start + 1), ("ZZ", "*", "*", "*", start, start + 1)]
    inventory = client.get_stations_bulk(bulk, level="channel")
    assert inventory.get_contents()["channels"] == ["XX.TWR.02.HNX"]


def test_more_than_is_given_at_once_is_refused(address: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = building_store.find(session, "TWR")
        stored(session, building, START + timedelta(days=1), dict.fromkeys(("XX.TWR.01.HNX", "XX.TWR.02.HNX"), GAIN))
    answer = httpx.get(f"{address}/fdsnws/dataselect/1/query?network=XX")
    assert (answer.status_code, answer.text[:11]) == (413, "Error 413: ")
    assert httpx.get(f"{address}/fdsnws/dataselect/1/query?network=XX&location=01").status_code == 200
    assert httpx.get(f"{address}/fdsnws/dataselect/1/query?endtime=2011-03-12").status_code == 200
    posted = httpx.post(f"{address}/fdsnws/dataselect/1/query", content=b"#" * (2**20 + 1))
    assert (posted.status_code, posted.text[:11]) == (413, "Error 413: ")


def test_a_gain_that_comes_and_goes_makes_epochs_that_do_not_overlap(
    address: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        building = building_store.find(session, "TWR")
        for day, gain in ((1, GAIN), (2, 2 * GAIN), (3, GAIN)):
            stored(session, building, START + timedelta(days=day), {"XX.TWR.01.HNX": gain})
    inventory = Client(base_url=address).get_stations(location="01", level="response")
    epochs = [(channel.start_date, channel.end_date) for channel in inventory[0][0]]
    days = [
        ((start - obspy.UTCDateTime(START)) // 86400, (end - obspy.UTCDateTime(START)) // 86400)
        for start, end in epochs
    ]
    assert days == [(0, 1), (2, 2), (3, 3)]
    for day, gain in enumerate((GAIN, GAIN, 2 * GAIN, GAIN)):
        response = inventory.get_response("XX.TWR.01.HNX", obspy.UTCDateTime(START) + day * 86400 + 1)
        assert response.instrument_sensitivity.value == pytest.approx(1 / gain, rel=1e-9)  # digits of the XML


def test_a_place_that_is_not_known_is_stated_not_to_be(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        text = BUILDING.replace("latitude = 35.5\nlongitude = 139.6\n", "")
        stored(session, building_store.add(session, text, Path("."), START), START, {"XX.TWR.01.HNX": GAIN})
    with api_server(database_url, max_dataselect_samples=MOST) as address:
        station = Client(base_url=address).get_stations(level="channel")[0][0]
        rows = httpx.get(f"{address}/fdsnws/station/1/query?format=text").text
        limited = httpx.get(f"{address}/fdsnws/station/1/query?minlatitude=-90")
    assert "not known" in station.comments[0].value
    assert "not known" in station[0].comments[0].value
    assert "place not known" in rows
    assert limited.status_code == 204


@pytest.mark.parametrize(
    ("query", "status"),
    [
        (f"channel={','.join(['H*N'] * 51)}", 413),
        (f"channel={','.join(['a*' * 40] * 5)}", 400),
        ("station=(a%2B)%2B$", 400),
        ("network=XX,YY,*&channel=HN?", 200),
        ("location=--", 204),
        ("channel=*N*,?*X", 200),
    ],
)
def test_codes_are_those_of_the_specification_and_not_too_many(address: str, query: str, status: int) -> None:
    answer = httpx.get(f"{address}/fdsnws/dataselect/1/query?{query}&endtime=2011-03-12")
    assert answer.status_code == status, answer.text[:200]


def test_more_lines_than_are_answered_at_once_are_refused(address: str) -> None:
    line = "XX TWR * HN? 2011-03-11 2011-03-12\n"
    assert httpx.post(f"{address}/fdsnws/dataselect/1/query", content=line * 501).status_code == 413


def test_the_hardest_question_stops_no_one(address: str) -> None:
    """130,000 patterns in one question kept a thread for minutes, and sixteen such questions all threads."""
    codes = ",".join(f"?*{number:02}*?*" for number in range(50))
    lines = "".join(f"{codes} {codes} * *{n:03}* 2011-03-11 2011-03-12\n" for n in range(500))
    with ThreadPoolExecutor(16) as api:
        requested = [
            api.submit(httpx.post, f"{address}/fdsnws/dataselect/1/query", content=lines, timeout=120.0)
            for _ in range(16)
        ]
        started = monotonic()
        assert httpx.get(f"{address}/login", timeout=60.0).status_code == 200
        assert monotonic() - started < 20.0, "where such questions kept threads for minutes"
        statuses = Counter(one.result().status_code for one in requested)
    assert set(statuses) <= {204, 429}, statuses
    assert statuses[429], "one key has a share of them"


def test_a_station_stands_where_the_latest_description_says(sessions: sessionmaker[Session]) -> None:
    moved = BUILDING.replace("latitude = 35.5", "latitude = -12.25")
    with sessions.begin() as session:
        stored(session, building_store.add(session, BUILDING, Path("."), START), START, {"XX.TWR.01.HNX": GAIN})
    with sessions.begin() as session:
        building_store.update_description(session, moved, Path("."), START)
    with sessions() as session, counted(session) as executed:
        [[station]] = inventory(session, [Selection()], None, "station")
    assert (station.latitude, station.longitude) == (-12.25, 139.6)
    assert not any("revision" in str(statement) for statement, _ in executed), "the description is not read for it"


@pytest.mark.parametrize("level", ["station", "channel"])
def test_stations_take_as_many_statements_among_three_buildings_as_among_forty(
    sessions: sessionmaker[Session], level: Level
) -> None:
    numbers, found = [], []
    for first, last in ((0, 3), (3, 40)):
        with sessions.begin() as session:
            for number in range(first, last):
                of = building_store.add(session, BUILDING.replace("TWR", f"T{number:02}"), Path("."), START)
                stored(session, of, START, {f"XX.T{number:02}.01.HNX": GAIN})
        for wanted in (Selection(station="T01"), Selection(network="X?", station="T*")):
            with sessions() as session, counted(session) as executed:
                found.append(
                    [station.code for network in inventory(session, [wanted], None, level) for station in network]
                )
                numbers.append(len(executed))
    assert found == [["T01"], ["T00", "T01", "T02"], ["T01"], [f"T{number:02}" for number in range(40)]]
    assert len(set(numbers)) == 1


@pytest.mark.parametrize(
    "query",
    [
        "",
        "network=*&station=T*",
        "station=t01",
        "station=T0?,T02&network=X*,YY",
        "minlatitude=35&maxlatitude=36",
        "minlatitude=36",
        "endtime=2011-03-12",
        "starttime=2011-03-13",
        "starttime=2011-03-11T12:00:00&endtime=2011-03-11T18:00:00",
    ],
)
def test_stations_are_the_same_whether_their_channels_are_looked_at_or_not(
    database_url: str, sessions: sessionmaker[Session], query: str
) -> None:
    """Stations T00 to T03: the second has no place, the third came a day later, the last has a channel that ended."""
    nowhere = BUILDING.replace("latitude = 35.5\nlongitude = 139.6\n", "")
    with sessions.begin() as session:
        for number in range(4):
            code, day = f"T{number:02}", START + timedelta(days=int(number == 2))
            text = (nowhere if number == 1 else BUILDING).replace("TWR", code)
            of = building_store.add(session, text, Path("."), START)
            stored(
                session, of, day + timedelta(hours=1), dict.fromkeys((f"XX.{code}.01.HNX", f"XX.{code}.02.HNX"), GAIN)
            )
            stored(session, of, day, {f"XX.{code}.01.HNX": GAIN})
            stored(session, of, day + timedelta(days=2), {f"XX.{code}.01.HNX": GAIN})
    with api_server(database_url, max_dataselect_samples=MOST) as address:
        for level in ("station", "network"):
            asked = f"{address}/fdsnws/station/1/query?{query}&format=text&level={level}"
            quick, looked_at = (httpx.get(f"{asked}&channel={channel}") for channel in ("*", "*N*"))
            assert (quick.status_code, quick.text) == (looked_at.status_code, looked_at.text)
            assert quick.status_code == (204 if query in ("station=t01", "minlatitude=36") else 200)


def test_stations_are_searched_among_the_wanted_channels_only(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        for code in ("TWR", "OTHER"):
            text = BUILDING.replace("TWR", code)
            stored(session, building_store.add(session, text, Path("."), START), START, {f"XX.{code}.01.HNX": GAIN})
    wanted = Selection(station="TWR")
    with sessions() as session, counted(session) as executed:
        found = inventory(session, [wanted], None, "channel")
        assert miniseed(session, [wanted], MOST)
    assert [station.code for network in found for station in network] == ["TWR"]
    reads = [str(values) for statement, values in executed if "waveform" in str(statement)]
    assert len(reads) == 3, "epochs, pieces and samples"
    assert not any("XX.OTHER.01.HNX" in one for one in reads)
    assert all("XX.TWR.01.HNX" in one for one in reads[:2])


@contextmanager
def counted(session: Session) -> Iterator[list[tuple[object, object]]]:
    """Statements and their parameters since then."""
    executed: list[tuple[object, object]] = []

    def note(*given: object) -> None:
        executed.append((given[2], given[3]))

    engine = session.get_bind()
    sqlalchemy_event.listen(engine, "before_cursor_execute", note)
    yield executed
    sqlalchemy_event.remove(engine, "before_cursor_execute", note)
