"""FDSN web services: stations, windows of time, the catalogue's earthquakes, and what comes late."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

from monitoring import START, Page, Server, miniseed, stream
from obspy import read

from service.sources.arrival import Arrival, Source
from service.sources.fdsnws import FdsnWebServices
from service.sources.http import Client

NOW = START + timedelta(days=1)
CHANNELS = tuple(f"XX.TOWER.0{number}.HNX" for number in range(3))


def look(source: Source, cursor: Mapping[str, Any], now: datetime = NOW) -> tuple[list[Arrival], Mapping[str, Any]]:
    arrivals: list[Arrival] = []
    for step in source.steps(cursor, now):
        arrivals += step.arrivals
        cursor = step.cursor
    return arrivals, cursor


def windows(server: Server, asking: Client, since: datetime) -> FdsnWebServices:
    return FdsnWebServices(server.address, CHANNELS, since, None, asking)


def samples(arrivals: list[Arrival]) -> int:
    from io import BytesIO

    merged = sum((read(BytesIO(arrival.data)) for arrival in arrivals if arrival.data), start=stream()[:0])
    return sum(trace.stats.npts for trace in merged.merge())


def test_years_of_silence_cost_few_questions(server: Server, asking: Client) -> None:
    server.waveforms = stream()
    source = windows(server, asking, datetime(1990, 1, 1, tzinfo=UTC))
    arrivals, cursor = look(source, {})
    assert samples(arrivals) == 3 * 2000
    assert len(server.asked) < 60
    asked = len(server.asked)
    assert look(source, cursor, NOW + timedelta(minutes=1))[0] == []
    assert len(server.asked) <= asked + 2


def test_what_is_too_large_is_asked_for_in_halves(server: Server, asking: Client) -> None:
    server.waveforms, server.most = stream(seconds=600), 100_000
    arrivals, _ = look(windows(server, asking, START - timedelta(days=1)), {})
    assert len(arrivals) > 1
    assert samples(arrivals) == 3 * 60_000


def test_a_minute_that_is_too_large_is_refused_and_passed(server: Server, asking: Client) -> None:
    server.waveforms, server.most = stream(seconds=30), 0
    arrivals, cursor = look(windows(server, asking, START - timedelta(hours=2)), {})
    assert arrivals
    assert all("max_answer_bytes" in (arrival.refusal or "") for arrival in arrivals)
    assert datetime.fromisoformat(cursor["until"]) >= NOW - timedelta(minutes=11)


def test_late_data_are_asked_for_again(server: Server, asking: Client) -> None:
    now = START + timedelta(minutes=5)
    source = windows(server, asking, START - timedelta(hours=1))
    server.waveforms = stream(seconds=20, locations=("00", "01"))
    _, cursor = look(source, {}, now)
    server.waveforms = stream(seconds=20)
    arrivals, _ = look(source, cursor, now + timedelta(minutes=1))
    assert samples(arrivals) == 3 * 2000


def test_stations_are_fetched_once_and_again_when_they_change(server: Server, asking: Client) -> None:
    page = server.pages["/fdsnws/station/1/query"] = Page(b"<xml><Created>now</Created></xml>")
    source = windows(server, asking, NOW)
    arrivals, cursor = look(source, {})
    assert [arrival.name for arrival in arrivals] == ["station.xml"]
    page.body = b"<xml><Created>later</Created></xml>"
    arrivals, cursor = look(source, cursor, NOW + timedelta(days=2))
    assert arrivals == []
    page.body = b"<xml><Created>later</Created>more</xml>"
    assert len(look(source, cursor, NOW + timedelta(days=4))[0]) == 1


def test_the_records_around_the_catalogues_earthquakes(server: Server, asking: Client) -> None:
    from io import BytesIO

    from obspy import UTCDateTime
    from obspy.core.event import Catalog, Event, Magnitude, Origin

    from service.sources.catalogue import Catalogue

    file = BytesIO()
    origin = Origin(time=UTCDateTime(START) + 5, latitude=0, longitude=0)
    Catalog([Event(origins=[origin], magnitudes=[Magnitude(mag=5)])]).write(file, "QUAKEML")
    server.pages["/fdsnws/event/1/version"] = Page(b"1.2.0")
    server.pages["/fdsnws/event/1/query"] = Page(file.getvalue())
    server.waveforms = stream(seconds=60)
    minute = timedelta(seconds=10)
    catalogue = Catalogue(server.address, minute / 10, minute, None, None, asking)
    source = FdsnWebServices(server.address, CHANNELS, START - timedelta(days=1), catalogue, asking)
    arrivals, cursor = look(source, {})
    assert samples(arrivals) == 3 * 1101
    assert look(source, cursor)[0] == []


def test_the_answer_is_what_the_logger_wrote(server: Server, asking: Client) -> None:
    server.waveforms = stream()
    (arrival,) = look(windows(server, asking, START - timedelta(minutes=1)), {})[0]
    assert arrival.data == miniseed(stream())
