"""Sources against a real server that misbehaves: what is there is fetched, what is not is said, nothing blows up."""

import threading
import tracemalloc
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from monitoring import START, Page, Server, miniseed, serving, stream
from obspy import read

from service.settings import Settings
from service.sources.archive import Archive
from service.sources.arrival import Arrival, Source, SourceError, TooLargeError
from service.sources.fdsnws import FdsnWebServices
from service.sources.http import Client, client

NOW = START + timedelta(days=1)
SETTINGS = Settings(http_timeout=0.5, http_retries=2, retry_delay=0.01, max_answer_bytes=1_000_000)
CHANNELS = tuple(f"XX.TOWER.0{number}.HNX" for number in range(3))


@pytest.fixture
def server() -> Iterator[Server]:
    with serving() as server:
        yield server


@pytest.fixture
def asking() -> Iterator[Client]:
    made = client(SETTINGS, threading.Event().wait)
    yield made
    made.http.close()


def look(source: Source, cursor: Mapping[str, Any], now: datetime = NOW) -> tuple[list[Arrival], Mapping[str, Any]]:
    arrivals: list[Arrival] = []
    for step in source.steps(cursor, now):
        arrivals += step.arrivals
        cursor = step.cursor
    return arrivals, cursor


def test_an_error_that_passes_is_tried_again(server: Server, asking: Client) -> None:
    server.pages["/a"] = Page(b"data", failures=2)
    assert asking.get(f"{server.address}/a").body == b"data"


def test_an_error_that_stays_is_told(server: Server, asking: Client) -> None:
    server.pages["/a"] = Page(b"data", failures=99)
    with pytest.raises(SourceError, match=r"/a answered 500 .*, 3 times"):
        asking.get(f"{server.address}/a")


def test_a_refusal_is_not_repeated(server: Server, asking: Client) -> None:
    server.pages["/a"] = Page(status=403)
    with pytest.raises(SourceError, match="answered 403 Forbidden"):
        asking.get(f"{server.address}/a")
    assert len(server.asked) == 1


def test_a_stalled_body_is_given_up(server: Server, asking: Client) -> None:
    server.pages["/a"] = Page(b"x" * 1000, stalls=True)
    with pytest.raises(SourceError, match=r"did not answer within 0\.5 s, 3 times"):
        asking.get(f"{server.address}/a")


def test_a_server_that_is_away_is_told(asking: Client) -> None:
    with pytest.raises(SourceError, match="cannot be reached"):
        asking.get("http://127.0.0.1:1/a")


def test_an_answer_that_broke_off_is_gone_on_with(server: Server, asking: Client) -> None:
    body = bytes(range(256)) * 100
    server.add("/a", body).breaks_after = 10_000
    assert asking.get(f"{server.address}/a").body == body
    assert server.asked[1][1]["Range"] == "bytes=10000-"


def test_two_gigabytes_are_refused_by_their_promise(server: Server, asking: Client) -> None:
    server.pages["/a"] = Page(b"x" * 1000, promised=2 * 10**9)
    tracemalloc.start()
    with pytest.raises(TooLargeError, match="has 2000000000 bytes, 1000000 are accepted"):
        asking.get(f"{server.address}/a")
    assert tracemalloc.get_traced_memory()[1] < 5_000_000
    tracemalloc.stop()


def index(server: Server, *lines: str) -> None:
    server.pages["/events/"] = Page(("<html><body>" + "\n".join(lines) + "</body></html>").encode())


def test_an_archive_is_fetched_once(server: Server, asking: Client) -> None:
    index(server, '<a href="../">up</a>', '<a href="a.mseed">a.mseed</a> 100', '<a href="2024/">2024</a>')
    server.pages["/events/2024/"] = Page(b'["b%20c.mseed"]')
    server.add("/events/a.mseed", b"A")
    server.add("/events/2024/b%20c.mseed", b"B")
    source = Archive(f"{server.address}/events/", asking)
    arrivals, cursor = look(source, {})
    assert {(arrival.name, arrival.data) for arrival in arrivals} == {("a.mseed", b"A"), ("b c.mseed", b"B")}
    assert look(source, cursor)[0] == []
    index(server, '<a href="a.mseed">a.mseed</a> 200')
    server.add("/events/a.mseed", b"AA")
    assert [arrival.data for arrival in look(source, cursor)[0]] == [b"AA"]


def test_an_archives_file_that_still_grows_is_left_for_the_next_look(server: Server, asking: Client) -> None:
    server.pages["/events/"] = Page(b"a.mseed")
    server.add("/events/a.mseed", b"A", changed=NOW - timedelta(seconds=1))
    source = Archive(f"{server.address}/events/", asking)
    arrivals, cursor = look(source, {})
    assert arrivals == []
    assert len(look(source, cursor, NOW + timedelta(minutes=1))[0]) == 1


def test_an_archives_file_that_is_too_large_is_refused_and_holds_up_no_other(server: Server, asking: Client) -> None:
    server.pages["/events/"] = Page(b"a.mseed\nb.mseed")
    server.pages["/events/a.mseed"] = Page(b"", promised=2 * 10**9)
    server.add("/events/b.mseed", b"B")
    arrivals, _ = look(Archive(f"{server.address}/events/", asking), {})
    assert "2000000000 bytes" in (arrivals[0].refusal or "")
    assert arrivals[1].data == b"B"


def test_an_interrupted_look_goes_on_at_its_cursor(server: Server, asking: Client) -> None:
    names = [f"{number}.mseed" for number in range(20)]
    server.pages["/events/"] = Page("\n".join(names).encode())
    for name in names:
        server.add(f"/events/{name}", name.encode())
    source = Archive(f"{server.address}/events/", asking)
    first = next(iter(source.steps({}, NOW)))
    rest, _ = look(source, first.cursor)
    assert sorted(a.name for a in [*first.arrivals, *rest]) == sorted(names)


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
