"""An archive's files are taken once, whole, and whatever becomes of the others."""

from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from monitoring_server import START, Page, Server, SourceMemory, miniseed, stream

from service.records.sources.archive import Archive
from service.records.sources.listing import listed
from service.records.sources.retried_requests import Client
from service.records.sources.source import Arrival, SourceError, Step

NOW = START + timedelta(days=1)


def look(source: Archive, cursor: Mapping[str, Any], now: datetime = NOW) -> tuple[list[Arrival], Mapping[str, Any]]:
    arrivals: list[Arrival] = []
    for step in source.steps(cursor, now):
        arrivals += step.arrivals
        cursor = step.cursor
        keep(source, step)
    return arrivals, cursor


def keep(source: Archive, step: Step) -> None:
    assert isinstance(source.memory, SourceMemory)
    source.memory.keep(step.files)


def archive(server: Server, api: Client) -> Archive:
    return Archive(f"{server.address}/events/", api, SourceMemory())


def index(server: Server, *lines: str) -> None:
    server.pages["/events/"] = Page(("<html><body>" + "\n".join(lines) + "</body></html>").encode())


def test_an_archive_is_fetched_once(server: Server, api: Client) -> None:
    index(server, '<a href="../">up</a>', '<a href="a.mseed">a.mseed</a> 100', '<a href="2024/">2024</a>')
    server.pages["/events/2024/"] = Page(b'["b%20c.mseed"]')
    server.add("/events/a.mseed", b"A")
    server.add("/events/2024/b%20c.mseed", b"B")
    source = archive(server, api)
    arrivals, cursor = look(source, {})
    assert {(arrival.name, arrival.data) for arrival in arrivals} == {("a.mseed", b"A"), ("b c.mseed", b"B")}
    assert look(source, cursor)[0] == []
    index(server, '<a href="a.mseed">a.mseed</a> 200')
    server.add("/events/a.mseed", b"AA")
    assert [arrival.data for arrival in look(source, cursor)[0]] == [b"AA"]


def test_an_archives_file_that_still_grows_is_left_for_the_next_look(server: Server, api: Client) -> None:
    server.pages["/events/"] = Page(b"a.mseed")
    server.add("/events/a.mseed", b"A", changed=NOW - timedelta(seconds=1))
    source = archive(server, api)
    arrivals, cursor = look(source, {})
    assert arrivals == []
    assert len(look(source, cursor, NOW + timedelta(minutes=1))[0]) == 1


def test_an_archives_file_that_is_too_large_is_refused_and_holds_up_no_other(server: Server, api: Client) -> None:
    server.pages["/events/"] = Page(b"a.mseed\nb.mseed")
    server.pages["/events/a.mseed"] = Page(b"", promised=2 * 10**9)
    server.add("/events/b.mseed", b"B")
    arrivals, _ = look(archive(server, api), {})
    assert "2000000000 bytes" in (arrivals[0].refusal or "")
    assert arrivals[1].data == b"B"


def test_an_interrupted_look_goes_on_at_its_cursor(server: Server, api: Client) -> None:
    names = [f"{number}.mseed" for number in range(20)]
    server.pages["/events/"] = Page("\n".join(names).encode())
    for name in names:
        server.add(f"/events/{name}", name.encode())
    source = archive(server, api)
    first = next(iter(source.steps({}, NOW)))
    keep(source, first)
    rest, _ = look(source, first.cursor)
    assert sorted(a.name for a in [*first.arrivals, *rest]) == sorted(names)


def test_a_file_that_cannot_be_had_holds_up_no_other(server: Server, api: Client) -> None:
    server.pages["/events/"] = Page(b"a.mseed\nb.mseed\nc.mseed")
    server.pages["/events/a.mseed"] = Page(status=403)
    server.pages["/events/b.mseed"] = Page(b"B", failures=99)
    server.add("/events/c.mseed", b"C")
    steps = archive(server, api).steps({}, NOW)
    assert [arrival.data for arrival in next(steps).arrivals] == [b"C"]
    assert "listings" in next(steps).cursor
    with pytest.raises(SourceError, match=r"a\.mseed answered 403"):
        next(steps)


def test_a_listing_that_did_not_change_is_not_sent_again(server: Server, api: Client) -> None:
    server.pages["/events/"] = Page(b"a.mseed\n2024/", headers={"ETag": '"1"'})
    server.pages["/events/2024/"] = Page(b"b.mseed", headers={"ETag": 'W/"2"'})
    server.add("/events/a.mseed", b"A", changed=NOW - timedelta(seconds=1))
    server.add("/events/2024/b.mseed", b"B")
    source = archive(server, api)
    later = NOW + timedelta(minutes=1)
    arrivals, cursor = look(source, {})
    assert [arrival.data for arrival in arrivals] == [b"B"]
    arrivals, cursor = look(source, cursor, later)  # the first listing is read again: its file was still growing
    assert [arrival.data for arrival in arrivals] == [b"A"]
    server.requested.clear()
    assert look(source, cursor, later) == ([], cursor)
    assert [headers["If-None-Match"] for _, headers in server.requested] == ['"1"', 'W/"2"']
    server.pages["/events/2024/"] = Page(b"b.mseed\nc.mseed", headers={"ETag": 'W/"3"'})
    server.add("/events/2024/c.mseed", b"C")
    assert [arrival.data for arrival in look(source, cursor, later)[0]] == [b"C"]


def test_a_listing_is_requested_by_its_time_unless_that_is_too_young(server: Server, api: Client) -> None:
    server.add("/events/", b"a.mseed", changed=datetime.now(UTC))
    server.add("/events/a.mseed", b"A")
    source = archive(server, api)
    _, cursor = look(source, {})
    assert cursor["listings"] == {}
    server.add("/events/", b"a.mseed", changed=START)
    _, cursor = look(source, cursor)
    look(source, cursor)
    assert server.requested[-1][1]["If-Modified-Since"] == "Mon, 01 Jan 2024 00:00:00 GMT"


def test_an_interrupted_download_is_resumed_at_the_next_poll(server: Server, api: Client) -> None:
    body = bytes(range(256)) * 100
    server.pages["/events/"] = Page(b"a.mseed")
    page = server.add("/events/a.mseed", body)
    page.breaks_after, page.breaks = 1_000, 1 + api.settings.polling.retries
    source = archive(server, api)
    with pytest.raises(SourceError, match="broke off its answer"):
        look(source, {})
    server.requested.clear()
    (arrival,), _ = look(source, {})
    assert arrival.data == body
    assert server.requested[-1][1]["Range"] == "bytes=3000-"
    assert len(server.requested) == 2


def test_the_beginning_of_another_version_is_thrown_away(server: Server, api: Client) -> None:
    server.pages["/events/"] = Page(b"a.mseed")
    page = server.add("/events/a.mseed", b"old" * 10_000)
    page.breaks_after, page.breaks = 1_000, 1 + api.settings.polling.retries
    source = archive(server, api)
    with pytest.raises(SourceError, match="broke off its answer"):
        look(source, {})
    server.add("/events/a.mseed", b"new", changed=START + timedelta(hours=1))
    assert [arrival.data for arrival in look(source, {})[0]] == [b"new"]


def test_half_a_body_of_unsaid_length_is_requested_a_few_times(server: Server, api: Client) -> None:
    whole = miniseed(stream())
    server.pages["/events/"] = Page(b"a.mseed")
    page = server.pages["/events/a.mseed"] = Page(whole[:-100], says_length=False)
    source = archive(server, api)
    for _ in range(api.settings.jobs.attempts - 1):
        with pytest.raises(SourceError, match=r"may have broken off .*truncated"):
            look(source, {})
    assert [arrival.data for arrival in look(source, {})[0]] == [whole[:-100]]
    assert look(source, {})[0] == []
    source = archive(server, api)
    with pytest.raises(SourceError, match="broken off"):
        look(source, {})
    page.body = whole
    assert [arrival.data for arrival in look(source, {})[0]] == [whole]
    assert look(source, {})[0] == []


@pytest.mark.parametrize(
    ("listing", "message"),
    [
        (b"[" * 100_000, "is not JSON"),
        (b"<" + b" " * 17 * 2**20, "lists files in 17825793 bytes, 16777216 are accepted"),
    ],
)
def test_a_listing_without_bounds_is_refused(server: Server, listing: bytes, message: str) -> None:
    with pytest.raises(SourceError, match=message):
        listed(f"{server.address}/events/", listing)


def test_an_entry_that_is_no_address_is_passed_over(server: Server) -> None:
    entries = listed(f"{server.address}/events/", b"http://[\na.mseed")
    assert [entry.address for entry in entries] == [f"{server.address}/events/a.mseed"]
