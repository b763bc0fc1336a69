"""Live streams: kept without gap or double, whatever the server does, and cut into earthquakes when they are over."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from threading import Thread
from time import monotonic, sleep

import numpy as np
import pytest
from live_streams import NOW, RECORDS, SENT, SERVER, SETTINGS, SHAKING, follower, received, state
from monitoring_server import LOCATIONS, START, building_file, miniseed, stream
from obspy import Stream, UTCDateTime
from seedlink_server import seedlink_server
from sqlalchemy import func, select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.buildings import store as building_store
from service.db.blobs import decode
from service.jobs.tables import Job
from service.records.source_poller import SourcePoller
from service.records.sources.source import SourceError
from service.records.streams.follower import Follower, TakenError
from service.records.streams.following import Streams
from service.records.tables import Event, Packet, Recording, SourceState, Waveform
from service.settings import Settings


@contextmanager
def followed(one: Follower) -> Iterator[None]:
    thread = Thread(target=one.run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        one.stop.set()
        thread.join(10)
        assert not thread.is_alive()


def wait_until(is_so: Callable[[], bool], seconds: float = 20) -> None:
    end = monotonic() + seconds
    while not is_so():
        assert monotonic() < end
        sleep(0.02)


def kept(sessions: sessionmaker[Session]) -> int:
    with sessions() as session:
        return session.scalar(select(func.count()).select_from(Packet)) or 0


def assert_whole(sessions: sessionmaker[Session], sent: Stream) -> None:
    """The one event has each channel in one piece, with the samples that were sent."""
    with sessions() as session:
        session.scalars(select(Event)).one()
        waveforms = session.scalars(select(Waveform).options(undefer(Waveform.samples))).all()
        assert sorted(one.channel for one in waveforms) == [f"XX.TOWER.{place}.HNX" for place in LOCATIONS]
        for one in waveforms:
            first = round((one.start - START).total_seconds() * 100)
            [trace] = sent.select(id=one.channel)
            assert (decode(one.samples) == trace.data[first : first + one.count]).all()
            assert first < SHAKING.start - 2500
            assert first + one.count > SHAKING.stop + 1900


@pytest.mark.parametrize("version", ["3", "4"])
def test_a_connection_that_breaks_loses_and_doubles_nothing(sessions: sessionmaker[Session], version: str) -> None:
    with seedlink_server(version) as server:
        one = follower(sessions, server.address)
        with followed(one):
            wait_until(lambda: server.do("count") == 1)
            third = len(RECORDS) // 3
            for at in range(0, len(RECORDS), third):
                server.add(RECORDS[at : at + third])
                wait_until(lambda: kept(sessions) > 0)
                server.do("drop")
            wait_until(lambda: kept(sessions) == len(RECORDS) and bool(state(sessions).cuts))
        assert any(request.startswith("DATA ") for request in server.requests())
    after = state(sessions)
    assert (after.packets, after.doubles, after.refused, after.protocol) == (len(RECORDS), 0, 0, version)
    assert {flow["missing"] for flow in after.channels.values()} == {0.0}
    assert_whole(sessions, SENT)
    with sessions() as session:
        assert session.scalars(select(Event)).one().state == "queued"
        assert session.scalar(select(func.count()).select_from(Job)) == 1
        source = session.scalars(select(SourceState)).one()
        assert source.cursor["stations"] == {"XX_TOWER": len(RECORDS)}
        assert source.error is None


def cut(sessions: sessionmaker[Session]) -> list[str]:
    with sessions() as session:
        names = session.scalars(select(Recording.name).order_by(Recording.id))
        return list(names)


def test_an_earthquake_is_cut_when_it_is_over_and_not_before(sessions: sessionmaker[Session]) -> None:
    one = follower(sessions)
    shaken, over = len(RECORDS) * 130 // 240, len(RECORDS) * 150 // 240
    one.keep(SERVER, received(RECORDS[:shaken]))
    one.look()
    assert (len(state(sessions).shaking), cut(sessions)) == (1, [])
    one.keep(SERVER, received(RECORDS[shaken:over], first=shaken + 1))
    one.look()
    assert (len(state(sessions).shaking), cut(sessions)) == (1, [])
    again = follower_after_a_restart(one)
    again.keep(SERVER, received(RECORDS[over:], first=over + 1))
    again.look()
    again.look()
    assert (len(state(sessions).shaking), len(cut(sessions))) == (0, 1)
    assert_whole(sessions, SENT)


BACK = NOW - timedelta(days=3)


@pytest.mark.parametrize("way", ["look", "again", "restart"])
def test_what_came_while_the_clock_was_set_back_is_used_once_it_is_right(
    sessions: sessionmaker[Session], way: str
) -> None:
    """With the next look, or when it is sent again, or after a restart; removing of old packets leaves it."""
    one, half = follower(sessions), len(RECORDS) // 2
    one.keep(SERVER, received(RECORDS[:half]))
    one.look()
    one.clock = lambda: BACK
    one.keep(SERVER, received(RECORDS[half:], first=half + 1))
    one.look()
    assert (state(sessions).refused, state(sessions).packets) == (len(RECORDS) - half, len(RECORDS))
    one = follower_after_a_restart(one) if way == "restart" else one
    one.clock = lambda: NOW
    one.hold()
    if way == "again":
        one.keep(SERVER, received(RECORDS, first=1))
    for _ in range(2):
        one.look()
    after = state(sessions)
    assert (after.refused, after.packets) == (0, len(RECORDS))
    assert after.doubles == (half if way == "again" else 0)
    assert {flow["missing"] for flow in after.channels.values()} == {0.0}
    assert len(cut(sessions)) == 1
    assert_whole(sessions, SENT)
    with sessions() as session:
        assert session.scalars(select(Event)).one().state == "queued"
        assert session.scalar(select(func.count()).select_from(Job)) == 1
        assert not session.scalar(select(func.count()).where(Packet.reason.is_not(None)))


def test_packets_of_a_time_long_gone_or_still_to_come_are_removed(sessions: sessionmaker[Session]) -> None:
    """Early packets stay only if their time has come."""
    one = follower(sessions)
    one.clock = lambda: BACK
    one.keep(SERVER, received(RECORDS[:30]))
    for days, left in ((0, 30), (-1.5, 0)):
        one.clock = lambda days=days: NOW + timedelta(days=days)
        one.hold()
        assert kept(sessions) == left


def test_an_earthquake_of_which_only_a_part_came_early_is_cut_anew(sessions: sessionmaker[Session]) -> None:
    """The packets of one channel were rejected, and are examined again after those of the others were cut out."""
    one = follower(sessions)
    early = [data for data in RECORDS if b"02HNX" in data[:20]]
    one.clock = lambda: BACK
    one.keep(SERVER, received(early))
    one.clock = lambda: NOW
    one.keep(SERVER, received([data for data in RECORDS if data not in early], first=len(early) + 1))
    one.lead = float("inf")  # as if so many came early that it is not their turn yet
    one.look()
    assert (state(sessions).refused, len(cut(sessions))) == (len(early), 1)
    one.lead = -float("inf")
    one.look()
    one.clock = lambda: NOW + timedelta(seconds=10)
    one.look()
    one.look()
    assert (state(sessions).refused, len(cut(sessions))) == (0, 2)
    assert_covered(sessions)


def follower_after_a_restart(one: Follower) -> Follower:
    return Follower(
        one.sessions, one.settings, one.building, one.described, one.source, "here", one.clock, gains=one.gains
    )


def test_a_stream_that_ends_in_the_shaking_is_cut_with_what_came_and_goes_on_later(
    sessions: sessionmaker[Session],
) -> None:
    one, shaken = follower(sessions), len(RECORDS) * 130 // 240
    one.keep(SERVER, received(RECORDS[:shaken]))
    one.clock = lambda: NOW + timedelta(seconds=SETTINGS.stream.patience)
    one.look()
    assert len(cut(sessions)) == 1
    one.keep(SERVER, received(RECORDS[shaken:], first=shaken + 1))
    one.look()
    one.clock = lambda: NOW + timedelta(minutes=1)
    one.look()
    one.look()
    with sessions() as session:
        event = session.scalars(select(Event)).one()
        assert (event.end - START).total_seconds() > SHAKING.stop / 100 + 19
        assert event.state == "queued"


def test_packets_may_come_out_of_order_twice_and_late(sessions: sessionmaker[Session]) -> None:
    one = follower(sessions)
    late = [index for index in range(len(RECORDS)) if 125 <= index * 240 / len(RECORDS) < 128]
    there = [data for index, data in enumerate(RECORDS) if index not in late]
    shuffled = [data for at in range(0, len(there), 10) for data in reversed(there[at : at + 10])]
    one.keep(SERVER, received(shuffled + shuffled[:20], first=700))
    one.look()
    assert state(sessions).doubles == 20
    assert max(flow["missing"] for flow in state(sessions).channels.values()) > 1
    assert len(cut(sessions)) == 1
    one.keep(SERVER, received([RECORDS[index] for index in late], first=5))
    one.look()
    one.clock = lambda: NOW + timedelta(seconds=10)
    one.look()
    one.look()
    assert len(cut(sessions)) == 2
    assert state(sessions).packets == len(RECORDS)
    assert_covered(sessions)


def assert_covered(sessions: sessionmaker[Session]) -> None:
    """Every channel of the one event has every sample, in however many pieces."""
    with sessions() as session:
        session.scalars(select(Event)).one()
        for place in LOCATIONS:
            had = select(Waveform.start, Waveform.count).where(Waveform.channel == f"XX.TOWER.{place}.HNX")
            spans = [(round((start - START).total_seconds() * 100), count) for start, count in session.execute(had)]
            first, last = min(start for start, _ in spans), max(start + count for start, count in spans)
            there = np.zeros(last - first, bool)
            for start, count in spans:
                there[start - first : start - first + count] = True
            assert there.all()


def test_packets_that_cannot_be_used_are_counted_with_a_reason_and_harm_no_others(
    sessions: sessionmaker[Session],
) -> None:
    one = follower(sessions)
    quiet = stream(START + timedelta(seconds=100), seconds=3)
    strange, fast, ahead, never_set = quiet.copy(), quiet.copy(), quiet.copy(), quiet.copy()
    for trace in strange:
        trace.stats.station = "OTHER"
    for trace in fast:
        trace.stats.sampling_rate = 100_000.0
    for trace in ahead:
        trace.stats.starttime += 40 * 86_400
    for trace in never_set:
        trace.stats.starttime = UTCDateTime(1970, 1, 2)
    header = bytearray(RECORDS[0])
    header[64:] = b"\xff" * (len(header) - 64)
    bad = {
        "is not miniSEED": b"\0" * 512,
        "not one record": RECORDS[0] + RECORDS[1],
        "OTHER.00.HNX is not a channel": miniseed(strange)[:512],
        "100000 samples a second": miniseed(fast)[:512],
        "set the clock": miniseed(ahead)[:512],
        "recorded at 1970-01-02": miniseed(never_set)[:512],
        "truncated or damaged": bytes(header),
    }
    for number, (reason, data) in enumerate(bad.items(), start=1):
        one.keep(SERVER, [*received(RECORDS[number : number + 1]), *received([data], first=2**64 - number)])
        assert reason in (state(sessions).problem or "")
    assert (state(sessions).refused, state(sessions).packets) == (len(bad), 2 * len(bad))
    one.keep(SERVER, received(RECORDS))
    one.look()
    assert_whole(sessions, SENT)
    assert state(sessions).refused == len(bad)


@pytest.mark.sqlite
@pytest.mark.parametrize(
    ("hostile", "said"),
    [
        (b"\0" * 600, "Unexpected data"),
        (b"SE2D\xff\xff\xff\xff" + b"\0" * 9, "sanity limit"),
        (b"SE\xff\xff\0\2\0\0" + b"\0" * 600, "cannot be understood"),
        (b"SE2D\0\0\2\0" + b"\0" * 9 + b"\0" * 2**17, "131072 bytes, 65536 are accepted"),
        (b"ERROR LIMIT too many\r\n", "too many"),
    ],
)
def test_a_hostile_server_ends_the_connection_and_nothing_else(
    sessions: sessionmaker[Session], hostile: bytes, said: str
) -> None:
    with seedlink_server("4") as server:
        one = follower(sessions, server.address)
        reader = Thread(target=lambda: caught.append(failure(one)))
        caught: list[str] = []
        reader.start()
        wait_until(lambda: server.do("count") == 1)
        server.add(RECORDS[:3])
        wait_until(lambda: kept(sessions) == 3)
        server.raw(hostile)
        reader.join(10)
    assert said in caught[0]
    assert kept(sessions) == 3


def failure(one: Follower) -> str:
    with pytest.raises(SourceError) as caught:
        one.follow()
    return str(caught.value)


@pytest.mark.sqlite
def test_a_server_that_says_nothing_is_given_up(sessions: sessionmaker[Session]) -> None:
    with seedlink_server("4") as server:
        one = follower(sessions, server.address)
        one.settings = Settings(stream={"silence": 1.0})
        assert re.search(r"has sent no packet for \d+ s", failure(one)), "more than one on a busy machine"


def test_a_server_that_cannot_be_reached_is_a_failing_source_until_it_answers(sessions: sessionmaker[Session]) -> None:
    with seedlink_server("4") as server:
        address = server.address
    one = follower(sessions, address)
    with followed(one):
        wait_until(lambda: source(sessions).failing_since is not None)
    assert "Connection refused" in (source(sessions).error or "")
    one.stop.clear()
    one.keep(SERVER, received(RECORDS[:1]))
    assert source(sessions).failing_since is None


def source(sessions: sessionmaker[Session]) -> SourceState:
    with sessions() as session:
        return session.scalars(select(SourceState)).one()


def test_a_stream_is_followed_by_one_process_at_a_time(sessions: sessionmaker[Session]) -> None:
    one = follower(sessions)
    other = follower_after_a_restart(one)
    other.holder = "there"
    with pytest.raises(TakenError):
        other.hold()
    one.clock = other.clock = lambda: NOW + timedelta(seconds=90)
    other.hold()
    with pytest.raises(TakenError):
        one.hold()


def test_packets_are_kept_for_so_long_and_numbers_that_begin_anew_harm_nothing(sessions: sessionmaker[Session]) -> None:
    one = follower(sessions)
    one.keep(SERVER, received(RECORDS[:30], first=5000))
    one.clock = lambda: NOW + timedelta(days=1, seconds=1)
    one.keep(SERVER, received(RECORDS[25:40], first=1))
    assert source(sessions).cursor["stations"] == {"XX_TOWER": 15}
    assert (state(sessions).doubles, kept(sessions)) == (5, 40)
    one.hold()
    assert kept(sessions) == 10
    one.keep(replace(SERVER, protocol="3"), [])
    assert source(sessions).cursor == {"address": SERVER.address, "protocol": "3", "stations": {}}


@pytest.mark.sqlite
def test_a_poller_follows_the_streams_of_its_share(sessions: sessionmaker[Session]) -> None:
    with seedlink_server("4") as server:
        one = follower(sessions, server.address)
        one.stop.set()
        one.run()  # gives its lease up
        streams = Streams(sessions, SETTINGS, "here", lambda: NOW, one.announce)
        poller = SourcePoller(sessions, SETTINGS, lambda: NOW, follow=streams.follow)
        for _ in range(2):
            assert poller.poll("TOWER")
        wait_until(lambda: server.do("count") == 1)
        with sessions.begin() as session:
            described = building_file("seedlink", server.address, gain="gain = 2e-6")
            building_store.update_description(session, described, Path("/"), NOW)
        assert poller.poll("TOWER")
        wait_until(lambda: sum(request == "END" for request in server.requests()) == 2)
        streams.keep_only(())
        wait_until(lambda: server.do("count") == 0)
        streams.end()
        assert poller.poll("TOWER")
        assert not streams.running
