"""Files come in: bytes first, then events; nothing is lost and every refusal has its reason."""

import re
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from monitoring_server import LOCATIONS, START, building_file, miniseed, stream
from obspy import Inventory, UTCDateTime
from obspy.core.inventory import Channel, Network, Response, Station
from obspy.core.inventory.response import InstrumentSensitivity
from shared_data import BNCS, needs_shared
from sqlalchemy import event as sqlalchemy_event, func, select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db.blobs import decode
from service.jobs.tables import Job
from service.records import events
from service.records.ingest import ingest
from service.records.recordings import gains
from service.records.tables import Content, Event, Recording, Waveform
from service.settings import Settings

NOW = START + timedelta(days=1)
SETTINGS = Settings(event_grace=120.0)
SHORT = {"settings": Settings(event_grace=120.0, longest_event=60.0)}
Bring = Callable[..., Recording]


@pytest.fixture
def bring(sessions: sessionmaker[Session]) -> Bring:
    """Brings a file to the building."""
    with sessions.begin() as session:
        building_store.add(session, building_file(), Path("/"), NOW)

    def bring(data: bytes, name: str = "a.mseed", now: datetime = NOW, settings: Settings = SETTINGS) -> Recording:
        with sessions.begin() as session:
            building = building_store.find(session, "TOWER")
            return ingest(session, building, name, f"/in/{name}", data, now, settings=settings)

    return bring


def found(sessions: sessionmaker[Session]) -> list[tuple[str, list[str]]]:
    """State and channels of every event, earliest first."""
    with sessions() as session:
        ordered = session.scalars(select(Event).order_by(Event.start))
        return [(event.state, [w.channel.split(".")[2] for w in event.waveforms]) for event in ordered]


def jobs(sessions: sessionmaker[Session]) -> int:
    with sessions() as session:
        return session.scalar(select(func.count()).select_from(Job)) or 0


def test_a_whole_event_is_queued_at_once(sessions: sessionmaker[Session], bring: Bring) -> None:
    traces = stream()
    assert bring(miniseed(traces)).state == "read"
    assert found(sessions) == [("queued", list(LOCATIONS))]
    assert jobs(sessions) == 1
    with sessions() as session:
        stored = session.scalars(select(Waveform).options(undefer(Waveform.samples)).order_by(Waveform.channel))
        for waveform, trace in zip(stored, traces, strict=True):
            assert (decode(waveform.samples) == trace.data).all()
            assert waveform.start == START


def test_an_event_has_the_largest_acceleration_of_its_files(sessions: sessionmaker[Session], bring: Bring) -> None:
    for location in LOCATIONS:
        bring(miniseed(stream(locations=(location,))), f"{location}.mseed")
    with sessions() as session:
        waveforms = session.scalars(select(Waveform).options(undefer(Waveform.samples))).all()
        pieces = [one.gain * decode(one.samples).astype(float) for one in waveforms]
        expected = max(np.abs(piece - piece.mean()).max() for piece in pieces)
        assert session.scalars(select(Event.recorded_peak)).one() == pytest.approx(expected, rel=1e-12)
        assert expected > 0


def test_the_same_bytes_twice_change_nothing(sessions: sessionmaker[Session], bring: Bring) -> None:
    data = miniseed(stream())
    assert bring(data).id == bring(data, "again.mseed").id
    assert (len(found(sessions)), jobs(sessions)) == (1, 1)


def test_files_of_one_earthquake_come_together(sessions: sessionmaker[Session], bring: Bring) -> None:
    for location in LOCATIONS:
        bring(miniseed(stream(locations=(location,))), f"{location}.mseed")
    assert found(sessions) == [("queued", list(LOCATIONS))]
    assert jobs(sessions) == 1


def test_earthquakes_far_apart_stay_apart(sessions: sessionmaker[Session], bring: Bring) -> None:
    bring(miniseed(stream()))
    bring(miniseed(stream(START + timedelta(minutes=10))), "b.mseed")
    assert [state for state, _ in found(sessions)] == ["queued", "queued"]


def test_an_event_waits_for_a_missing_channel_and_no_longer(sessions: sessionmaker[Session], bring: Bring) -> None:
    bring(miniseed(stream(locations=("00", "01"))))
    assert found(sessions) == [("gathering", ["00", "01"])]
    with sessions.begin() as session:
        assert events.queue_ready(session, NOW + timedelta(seconds=119), settings=SETTINGS) == 0
        assert events.queue_ready(session, NOW + timedelta(seconds=121), settings=SETTINGS) == 1
    assert found(sessions)[0][0] == "queued"


def test_a_late_file_joins_its_event_which_is_analysed_again(sessions: sessionmaker[Session], bring: Bring) -> None:
    bring(miniseed(stream(locations=("00", "01"))))
    with sessions.begin() as session:
        events.queue_ready(session, NOW + timedelta(hours=1), settings=SETTINGS)
        job, event = session.scalars(select(Job)).one(), session.scalars(select(Event)).one()
        job.state, event.state = "done", "analysed"
    bring(miniseed(stream(locations=("02",))), "late.mseed", NOW + timedelta(days=1))
    assert found(sessions) == [("queued", list(LOCATIONS))]
    assert jobs(sessions) == 2


def test_a_file_that_closes_the_time_between_two_joins_them(sessions: sessionmaker[Session], bring: Bring) -> None:
    whole = stream(seconds=60, locations=("00",))
    pieces = [whole.slice(*(UTCDateTime(START) + s for s in (a, a + 19.99))) for a in (0, 40, 20)]
    for number, piece in enumerate(pieces[:2]):
        bring(miniseed(piece), f"{number}.mseed")
    assert len(found(sessions)) == 2
    bring(miniseed(pieces[2]), "between.mseed")
    assert found(sessions) == [("gathering", ["00", "00", "00"])]


def test_overlapping_files_are_stored_once(sessions: sessionmaker[Session], bring: Bring) -> None:
    whole = stream(seconds=60)
    start = UTCDateTime(START)
    bring(miniseed(whole.slice(start, start + 40)))
    bring(miniseed(whole.slice(start + 20, start + 60)), "b.mseed")
    with sessions() as session:
        counts = session.execute(select(Waveform.channel, func.sum(Waveform.count)).group_by(Waveform.channel))
        assert {count for _, count in counts} == {6000}


def test_overlapping_files_that_disagree_are_both_kept(sessions: sessionmaker[Session], bring: Bring) -> None:
    start = UTCDateTime(START)
    bring(miniseed(stream(seconds=40)))
    bring(miniseed(stream(seconds=60, seed=2).slice(start + 20, start + 60)), "b.mseed")
    assert [len(channels) for _, channels in found(sessions)] == [6]


REFUSED = {
    "truncated": (miniseed(stream())[:-100], "truncated"),
    "HTML": (b"<!DOCTYPE html><html><head><title>Login</title></head></html>", r"HTML page \(Login\)"),
    "empty": (b"", "empty"),
    "text": (b"hello", "an unknown format"),
    "unknown network": (
        miniseed(stream()).replace(b"HNXXX", b"HNXYY"),
        r"no channel of this building: found YY.TOWER.00.HNX.*the building has XX.TOWER.00.HNX",
    ),
    "clock in the future": (miniseed(stream(datetime(2031, 1, 1, tzinfo=UTC))), "set the logger's clock"),
    "clock never set": (miniseed(stream(datetime(1971, 1, 1, tzinfo=UTC))), "set the logger's clock"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_bad_bytes_are_kept_with_their_reason(sessions: sessionmaker[Session], bring: Bring, kind: str) -> None:
    data, reason = REFUSED[kind]
    recording = bring(data)
    assert recording.state == "refused"
    with sessions() as session:
        kept = session.get_one(Content, recording.sha256, options=[undefer(Content.data)])
        assert kept.data == data
        assert session.scalars(select(Event)).all() == []
    assert re.search(reason, recording.reason or ""), recording.reason


def test_a_jump_of_the_clock_within_a_file_makes_two_events(sessions: sessionmaker[Session], bring: Bring) -> None:
    jumped = stream() + stream(START + timedelta(hours=3))
    bring(miniseed(jumped))
    assert found(sessions) == [("queued", list(LOCATIONS))] * 2


def test_strange_channels_are_named(sessions: sessionmaker[Session], bring: Bring) -> None:
    traces = stream(locations=("00", "09"))
    recording = bring(miniseed(traces))
    assert recording.state == "read"
    assert "XX.TOWER.09.HNX" in (recording.reason or "")


def test_a_building_described_anew_reads_again_what_was_refused(sessions: sessionmaker[Session], bring: Bring) -> None:
    bring(miniseed(stream(locations=("00", "01", "02", "09"))))
    channel = building_file().rsplit("[[channel]]", 1)[1]
    longer = f"{building_file()}[[channel]]{channel.replace('.02.', '.09.')}"
    with sessions.begin() as session:
        assert building_store.update_description(session, longer, Path("/"), NOW).number == 2
    bring(b"anything that makes the path run")
    assert found(sessions) == [("queued", ["00", "01", "02", "09"])]


def stationxml() -> bytes:
    sensitivity = InstrumentSensitivity(1e6, 1.0, "M/S**2", "COUNTS")
    channels = [
        Channel("HNX", location, 0, 0, 0, 0, response=Response(instrument_sensitivity=sensitivity), sample_rate=100)
        for location in LOCATIONS
    ]
    file = BytesIO()
    Inventory([Network("XX", [Station("TOWER", 0, 0, 0, channels=channels)])], source="test").write(file, "STATIONXML")
    return file.getvalue()


def test_records_that_came_before_their_station_file_are_read_when_it_comes(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = building_store.add(session, building_file(gain=""), Path("/"), NOW)
        early = ingest(session, building, "a.mseed", "/a.mseed", miniseed(stream()), NOW, settings=SETTINGS)
        assert (early.state, early.kind) == ("refused", "waveforms")
        assert "StationXML" in (early.reason or "")
        ingest(session, building, "station.xml", "/station.xml", stationxml(), NOW, settings=SETTINGS)
        assert (early.state, early.reason) == ("read", None)
    assert found(sessions) == [("queued", list(LOCATIONS))]


@needs_shared
def test_the_real_building_in_any_order(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building: Building = building_store.add(session, (BNCS / "building.toml").read_text(), BNCS, datetime.now(UTC))
        for name in ("SP100.mseed", "station.xml", "LAC100.mseed", "CNP100.mseed"):
            data = (BNCS / name).read_bytes()
            ingest(session, building, name, str(BNCS / name), data, datetime.now(UTC), settings=SETTINGS)
    assert [(state, len(channels)) for state, channels in found(sessions)] == [("queued", 8)] * 3


@pytest.mark.parametrize("rate", [0.0001, 9.9, 2001.0])
def test_a_sampling_rate_that_no_logger_has_is_refused(
    sessions: sessionmaker[Session], bring: Bring, rate: float
) -> None:
    traces = stream()
    for trace in traces:
        trace.data, trace.stats.sampling_rate = trace.data[:1000], rate
    recording = bring(miniseed(traces), now=NOW + timedelta(days=400))
    assert recording.state == "refused"
    assert f"has {rate:g} samples a second; 10 to 2000 Hz are accepted for acceleration" in (recording.reason or "")
    assert found(sessions) == []


def test_a_record_that_is_too_long_for_an_earthquake_is_refused(sessions: sessionmaker[Session], bring: Bring) -> None:
    traces = stream(seconds=2 * 3600)
    for trace in traces:
        trace.stats.sampling_rate = 50.0
    recording = bring(miniseed(traces))
    assert recording.state == "refused"
    assert "the record lasts 4 h, from 2024-01-01 00:00:00 to 2024-01-01 03:59:59 UTC" in (recording.reason or "")
    assert found(sessions) == []


def test_files_that_follow_each_other_do_not_become_an_endless_event(
    sessions: sessionmaker[Session], bring: Bring
) -> None:
    for number in range(8):
        bring(miniseed(stream(START + timedelta(seconds=20 * number), seed=number)), f"{number}.mseed", **SHORT)
    with sessions() as session:
        lengths = [(event.end - event.start).total_seconds() for event in session.scalars(select(Event))]
        assert len(lengths) > 1
        assert max(lengths) <= SHORT["settings"].event.longest + 2 * SETTINGS.event.tolerance
        assert session.scalar(select(func.sum(Waveform.count))) == 8 * 2000 * len(LOCATIONS)


def test_the_bytes_of_station_files_are_fetched_once(sessions: sessionmaker[Session], bring: Bring) -> None:
    gain = InstrumentSensitivity(1e6, 1.0, "M/S**2", "COUNTS")
    channel = Channel("HNX", "00", 0, 0, 0, 0, response=Response(instrument_sensitivity=gain))
    out = BytesIO()
    Inventory([Network("XX", [Station("TOWER", 0, 0, 0, channels=[channel])])]).write(out, format="STATIONXML")
    bring(out.getvalue(), "station.xml")
    with sessions() as session:
        building = building_store.find(session, "TOWER")
        before = gains(session, building, SETTINGS)
        statements: list[str] = []
        engine = session.get_bind()
        sqlalchemy_event.listen(engine, "before_cursor_execute", lambda *given: statements.append(given[2]))
        assert gains(session, building, SETTINGS) == before
    assert statements
    assert not [statement for statement in statements if "content" in statement]
