"""FDSN web services: stations, windows of time, the catalogue's earthquakes, and what comes late."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from io import BytesIO
from typing import Any
from urllib.parse import parse_qsl, urlsplit

import numpy as np
import pytest
from monitoring_server import START, Page, Server, miniseed, stream
from obspy import Stream, UTCDateTime, read
from obspy.core.event import Catalog, Event, Magnitude, Origin

from service.records.sources.catalogue import Catalogue
from service.records.sources.fdsnws import FdsnWebServices
from service.records.sources.retried_requests import Client
from service.records.sources.source import Arrival, Source
from service.settings import Settings

NOW = START + timedelta(days=1)
LATE = timedelta(seconds=Settings().polling.late_data)
CHANNELS = tuple(f"XX.TOWER.0{number}.HNX" for number in range(3))


def look(source: Source, cursor: Mapping[str, Any], now: datetime = NOW) -> tuple[list[Arrival], Mapping[str, Any]]:
    arrivals: list[Arrival] = []
    for step in source.steps(cursor, now):
        arrivals += step.arrivals
        cursor = step.cursor
    return arrivals, cursor


def windows(server: Server, api: Client, since: datetime) -> FdsnWebServices:
    return FdsnWebServices(server.address, CHANNELS, since, None, api)


def samples(arrivals: list[Arrival]) -> int:
    merged = sum((read(BytesIO(arrival.data)) for arrival in arrivals if arrival.data), start=stream()[:0])
    return sum(np.ma.count(trace.data) for trace in merged.merge())


def test_years_of_silence_cost_few_questions(server: Server, api: Client) -> None:
    server.waveforms = stream()
    source = windows(server, api, datetime(1990, 1, 1, tzinfo=UTC))
    arrivals, cursor = look(source, {})
    assert samples(arrivals) == 3 * 2000
    assert len(server.requested) < 60
    requested = len(server.requested)
    assert look(source, cursor, NOW + timedelta(minutes=1))[0] == []
    assert len(server.requested) <= requested + 2


def test_what_is_too_large_is_requested_in_halves(server: Server, api: Client) -> None:
    server.waveforms, server.most = stream(seconds=600), 100_000
    arrivals, _ = look(windows(server, api, START - timedelta(days=1)), {})
    assert len(arrivals) > 1
    assert samples(arrivals) == 3 * 60_000


def test_a_minute_that_is_too_large_is_refused_and_passed(server: Server, api: Client) -> None:
    server.waveforms, server.most = stream(seconds=30), 0
    arrivals, cursor = look(windows(server, api, START - timedelta(hours=2)), {})
    assert arrivals
    assert all("max_answer_bytes" in (arrival.refusal or "") for arrival in arrivals)
    assert datetime.fromisoformat(cursor["until"]) == NOW - LATE


def test_late_data_are_requested_again(server: Server, api: Client) -> None:
    now = START + timedelta(minutes=5)
    source = windows(server, api, START - timedelta(hours=1))
    server.waveforms = stream(seconds=20, locations=("00", "01"))
    _, cursor = look(source, {}, now)
    server.waveforms = stream(seconds=20)
    arrivals, _ = look(source, cursor, now + timedelta(minutes=1))
    assert samples(arrivals) == 2000


def questions(server: Server) -> list[dict[str, str]]:
    """Requests to dataselect since the last call."""
    requested = [path for path, _ in server.requested if path.startswith("/fdsnws/dataselect")]
    server.requested.clear()
    return [dict(parse_qsl(urlsplit(path).query)) for path in requested]


def test_a_hole_that_the_server_fills_late_is_requested_alone(server: Server, api: Client) -> None:
    now = START + timedelta(minutes=10)
    whole, begin = stream(seconds=600), UTCDateTime(START)
    server.waveforms = Stream([*whole[:1], *Stream(whole[1].copy()).cutout(begin + 100, begin + 200), *whole[2:]])
    source = windows(server, api, START)
    arrivals, cursor = look(source, {}, now)
    assert samples(arrivals) == 3 * 60_000 - 9_999
    questions(server)
    arrivals, cursor = look(source, cursor, now + timedelta(minutes=1))
    assert arrivals == []
    assert [question["location"] for question in questions(server)] == ["01", "00,01,02"]
    server.waveforms = whole
    arrivals, cursor = look(source, cursor, now + timedelta(minutes=2))
    assert samples(arrivals) == 9_999
    assert len(questions(server)) == 2
    assert look(source, cursor, now + timedelta(minutes=3))[0] == []
    assert len(questions(server)) == 1


def test_a_dead_channel_costs_one_question_and_no_bytes(server: Server, api: Client) -> None:
    server.waveforms = stream(START - timedelta(hours=3), seconds=4 * 3600, locations=("00", "01"))
    source, cursor = windows(server, api, START - timedelta(hours=3)), {}
    _, cursor = look(source, cursor, START)
    for minute in range(1, 4):
        questions(server)
        arrivals, cursor = look(source, cursor, START + timedelta(minutes=minute))
        assert samples(arrivals) == pytest.approx(2 * 6_000, abs=2 * 100)
        late, _ = questions(server)
        assert late["location"] == "02"
        assert LATE * 0.9 <= times(late)[1] - times(late)[0] <= LATE


def times(question: dict[str, str]) -> tuple[datetime, datetime]:
    start, end = (datetime.fromisoformat(question[name]) for name in ("starttime", "endtime"))
    return start, end


def test_channels_of_an_earthquake_that_come_late_are_requested_again(server: Server, api: Client) -> None:
    soon = START + timedelta(minutes=1)
    server.waveforms = stream(seconds=60, locations=("00", "01"))
    source = around_an_earthquake(server, api)
    arrivals, cursor = look(source, {}, soon)
    assert samples(arrivals) == 2 * 1101
    questions(server)
    arrivals, cursor = look(source, cursor, soon + LATE / 2)
    assert arrivals == []
    assert [question["location"] for question in questions(server)] == ["02"]
    missed, _ = look(source, cursor, soon + LATE)
    assert missed == []
    assert questions(server) == []
    server.waveforms = stream(seconds=60)
    arrivals, cursor = look(source, cursor, soon + LATE * 0.9)
    assert samples(arrivals) == 1101
    questions(server)
    look(source, cursor, soon + LATE * 0.95)
    assert questions(server) == []


def test_stations_are_fetched_once_and_again_when_they_change(server: Server, api: Client) -> None:
    page = server.pages["/fdsnws/station/1/query"] = Page(b"<xml><Created>now</Created></xml>")
    source = windows(server, api, NOW)
    arrivals, cursor = look(source, {})
    assert [arrival.name for arrival in arrivals] == ["station.xml"]
    page.body = b"<xml><Created>later</Created></xml>"
    arrivals, cursor = look(source, cursor, NOW + timedelta(days=2))
    assert arrivals == []
    page.body = b"<xml><Created>later</Created>more</xml>"
    assert len(look(source, cursor, NOW + timedelta(days=4))[0]) == 1


def around_an_earthquake(server: Server, api: Client) -> FdsnWebServices:
    """5 s after START; from 1 s before it to 10 s after it."""
    file = BytesIO()
    origin = Origin(time=UTCDateTime(START) + 5, latitude=0, longitude=0)
    Catalog([Event(origins=[origin], magnitudes=[Magnitude(mag=5)])]).write(file, "QUAKEML")
    server.pages["/fdsnws/event/1/version"] = Page(b"1.2.0")
    server.pages["/fdsnws/event/1/query"] = Page(file.getvalue())
    catalogue = Catalogue(server.address, timedelta(seconds=1), timedelta(seconds=10), None, None, api)
    return FdsnWebServices(server.address, CHANNELS, START - timedelta(days=1), catalogue, api)


def test_the_records_around_the_catalogues_earthquakes(server: Server, api: Client) -> None:
    server.waveforms = stream(seconds=60)
    source = around_an_earthquake(server, api)
    arrivals, cursor = look(source, {})
    assert samples(arrivals) == 3 * 1101
    assert look(source, cursor)[0] == []


def test_the_answer_is_what_the_logger_wrote(server: Server, api: Client) -> None:
    server.waveforms = stream()
    (arrival,) = look(windows(server, api, START - timedelta(minutes=1)), {})[0]
    assert arrival.data == miniseed(stream())
