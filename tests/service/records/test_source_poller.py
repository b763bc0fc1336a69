"""Polls of sources: the same results by every way in, failures reported once, nothing lost in between."""

import logging
import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from datetime import datetime, timedelta
from pathlib import Path

import pytest
from monitoring_server import START, Page, Server, building_file, miniseed, monitoring_server, stream
from sqlalchemy import delete, event, select, update
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.buildings import store as building_store
from service.buildings.tables import Building
from service.jobs.tables import Job
from service.records.ingest import begin, ingest
from service.records.originals import Secured, secured
from service.records.recordings import store
from service.records.source_poller import SourcePoller, source_state
from service.records.tables import Event, EventRecording, Recording, SourceState, Waveform
from service.settings import Settings
from service.version import VERSION

NOW = START + timedelta(days=1)
LIMITS = {"http_timeout": 10, "http_retries": 1, "retry_delay": 0.01, "max_answer_bytes": 10_000_000}
SETTINGS = Settings(**LIMITS)
TABLES = ("content", "recording", "fetched_file", "event", "waveform", "job")
"""Tables to which a new file adds rows."""


@pytest.fixture
def server() -> Iterator[Server]:
    with monitoring_server() as server:
        yield server


def look(sessions: sessionmaker[Session], now: datetime = NOW) -> None:
    SourcePoller(sessions, SETTINGS, clock=lambda: now).poll_all()


def kept(data: bytes) -> Secured:
    """Bytes that a recording may name."""
    return secured(data, SETTINGS.storage)


def add(sessions: sessionmaker[Session], kind: str, location: str) -> None:
    with sessions.begin() as session:
        building_store.add(session, building_file(kind, location), Path("/"), NOW)


def stored(sessions: sessionmaker[Session]) -> list[tuple[str, datetime, bytes]]:
    with sessions() as session:
        rows = session.scalars(
            select(Waveform).options(undefer(Waveform.samples)).order_by(Waveform.channel, Waveform.start)
        )
        return [(row.channel, row.start, row.samples) for row in rows]


def state(sessions: sessionmaker[Session]) -> SourceState:
    with sessions() as session:
        return session.scalars(select(SourceState)).one()


@pytest.mark.parametrize("kind", ["folder", "archive", "fdsnws"])
def test_every_way_in_stores_the_same(
    sessions: sessionmaker[Session], server: Server, tmp_path: Path, kind: str
) -> None:
    data = miniseed(stream())
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.mseed").write_bytes(data)
    server.pages["/events/"] = Page(b"a.mseed")
    server.add("/events/a.mseed", data)
    server.waveforms = stream()
    locations = {"folder": f"{tmp_path}/in", "archive": f"{server.address}/events/", "fdsnws": server.address}
    add(sessions, kind, locations[kind])
    later = datetime.now(START.tzinfo) + timedelta(minutes=1)  # the file in the folder is of today
    for _ in range(2):
        look(sessions, later)
    assert [channel for channel, _, _ in stored(sessions)] == [f"XX.TOWER.0{n}.HNX" for n in range(3)]
    with sessions() as session:
        assert [event.state for event in session.scalars(select(Event))] == ["queued"]
        assert len(session.scalars(select(Job)).all()) == 1
        assert len(session.scalars(select(EventRecording)).all()) == 1


def test_a_failing_source_is_reported_once_and_its_recovery_too(
    sessions: sessionmaker[Session], server: Server, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, logger="service")
    server.pages["/events/"] = Page(b"a.mseed", failures=4)  # two tries, then one at each look
    server.add("/events/a.mseed", miniseed(stream()))
    add(sessions, "archive", f"{server.address}/events/")
    look(sessions)
    look(sessions, NOW + timedelta(minutes=1))
    failing = state(sessions)
    assert failing.failing_since == NOW
    assert "answered 500" in (failing.error or "")
    look(sessions, NOW + timedelta(minutes=2))
    look(sessions, NOW + timedelta(minutes=3))
    recovered = state(sessions)
    assert (recovered.failing_since, recovered.error) == (None, None)
    of_sources = [record.message for record in caplog.records if record.name == "service.records.source_poller"]
    assert [message.split(":")[0] for message in of_sources] == [
        "the source of TOWER begins to fail",
        "the source of TOWER has recovered",
    ]
    assert len(stored(sessions)) == 3


def test_two_gigabytes_are_refused_with_their_size(sessions: sessionmaker[Session], server: Server) -> None:
    server.pages["/events/"] = Page(b"a.mseed\nb.mseed")
    server.pages["/events/a.mseed"] = Page(b"", promised=2 * 10**9)
    server.add("/events/b.mseed", miniseed(stream()))
    add(sessions, "archive", f"{server.address}/events/")
    look(sessions)
    with sessions() as session:
        refused, taken = session.scalars(select(Recording).order_by(Recording.name))
        assert (refused.state, refused.sha256, taken.state) == ("refused", None, "read")
        assert "2000000000 bytes, 10000000 are accepted" in (refused.reason or "")


@pytest.mark.parametrize("kind", ["archive", "fdsnws"])
def test_a_page_in_place_of_data_is_kept_and_the_data_are_requested_again(
    sessions: sessionmaker[Session], server: Server, kind: str
) -> None:
    page = Page(b"<html><title>Maintenance</title></html>")
    server.pages |= {"/fdsnws/dataselect/1/query": page, "/events/a.mseed": page, "/events/": Page(b"a.mseed")}
    add(sessions, kind, server.address + ("/events/" if kind == "archive" else ""))
    look(sessions)
    with sessions() as session:
        (recording,) = session.scalars(select(Recording))
        assert recording.state == "refused"
        assert "Maintenance" in (recording.reason or "")
    assert "HTML page" in (state(sessions).error or "")
    page.body = miniseed(stream())
    del server.pages["/fdsnws/dataselect/1/query"]
    server.waveforms = stream()
    look(sessions, NOW + timedelta(minutes=1))
    assert len(stored(sessions)) == 3
    assert state(sessions).error is None


def test_what_was_stored_before_a_crash_is_read_at_the_next_look(sessions: sessionmaker[Session]) -> None:
    add(sessions, "folder", "/nowhere")
    with sessions.begin() as session:
        store(session, building_store.find(session, "TOWER"), "a.mseed", "/a.mseed", kept(miniseed(stream())), NOW)
    look(sessions)
    with sessions() as session:
        assert session.scalars(select(Recording)).one().state == "read"
        assert session.scalars(select(Event)).one().state == "queued"


def test_what_came_while_the_clock_was_set_back_is_read_once_it_is_right(
    sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    """Once, and without another look at the file; what a logger's clock dates ahead stays rejected."""
    ahead, incoming = miniseed(stream(NOW + timedelta(days=40))), tmp_path / "in"
    incoming.mkdir()
    for name, data in (("good", miniseed(stream(NOW - timedelta(minutes=5)))), ("ahead", ahead)):
        (incoming / f"{name}.mseed").write_bytes(data)
        os.utime(incoming / f"{name}.mseed", (0, 0))
    add(sessions, "folder", str(incoming))

    def states() -> dict[str, str]:
        with sessions() as session:
            return {one.name: one.state for one in session.scalars(select(Recording))}

    for back in (timedelta(days=3), timedelta(days=2)):
        look(sessions, NOW - back)
        assert states() == {"good.mseed": "refused", "ahead.mseed": "refused"}
    (incoming / "good.mseed").unlink()
    for _ in range(2):
        look(sessions, NOW)
        assert states() == {"good.mseed": "read", "ahead.mseed": "refused"}
    with sessions() as session:
        assert [one.state for one in session.scalars(select(Event))] == ["queued"]
        assert len(session.scalars(select(Job)).all()) == 1
    assert len(stored(sessions)) == 3


def test_what_is_rejected_for_another_reason_has_no_times_and_is_not_read_again(
    sessions: sessionmaker[Session],
) -> None:
    """Not even if it was read before: it would be read at every poll."""
    add(sessions, "folder", "/nowhere")
    with sessions.begin() as session:
        building = building_store.find(session, "TOWER")
        recording = ingest(session, building, "a", "/a", miniseed(stream()), NOW, settings=SETTINGS)
        assert (recording.state, recording.start) == ("read", START)
        strange = building_file("folder", "/nowhere").replace("XX.TOWER", "XX.OTHER")
        building_store.update_description(session, strange, Path("/"), NOW)
        recording.state = "stored"
    look(sessions)
    with sessions() as session:
        recording = session.scalars(select(Recording)).one()
        assert (recording.state, recording.start, recording.end) == ("refused", None, None)
    found = SourcePoller(sessions, SETTINGS).together.found("TOWER", NOW)
    assert found is not None
    assert (found.is_to_read, found.is_to_read_again) == (False, False)


def test_a_poller_that_is_to_stop_leaves_the_other_files_to_the_next_poll(sessions: sessionmaker[Session]) -> None:
    """This holds at the start of a poll too, where files of an interrupted one are waiting."""
    with sessions.begin() as session:
        building = building_store.add(session, building_file("folder", "/nowhere"), Path("/"), NOW)
        for number in range(3):
            later = miniseed(stream(START + timedelta(hours=number)))
            store(session, building, f"{number}.mseed", "test", kept(later), NOW)

    def read() -> int:
        with sessions() as session:
            return len(session.scalars(select(Recording).where(Recording.state == "read")).all())

    stopping = SourcePoller(sessions, SETTINGS, clock=lambda: NOW, stopped=lambda: read() > 0)
    assert stopping.poll("TOWER")
    assert read() == 1
    with sessions() as session:
        assert session.scalars(select(SourceState)).all() == []
        assert set(session.scalars(select(Recording.failures))) == {0}, "the next one was not tried"
    look(sessions)
    assert read() == 3
    assert state(sessions).failing_since == NOW, "the folder is not there, which the second poll saw"


@pytest.fixture
def stumbling(sessions: sessionmaker[Session]) -> int:
    """A stored recording over which the code fails, with a sound one behind it; the id of the first.

    It overlaps an event whose samples are damaged in the database.
    """
    files = {"whole": stream(), "overlapping": stream(seconds=30), "sound": stream(START + timedelta(hours=1))}
    add(sessions, "folder", "/nowhere")
    with sessions.begin() as session:
        building = building_store.find(session, "TOWER")
        ingest(session, building, "whole", "/whole", miniseed(files.pop("whole")), NOW, settings=SETTINGS)
        session.execute(update(Waveform).values(samples=b"damaged"))
        stored = [store(session, building, name, f"/{name}", kept(miniseed(data)), NOW) for name, data in files.items()]
        return stored[0].id


def test_what_the_code_fails_at_is_given_up_and_holds_up_no_other(
    sessions: sessionmaker[Session], stumbling: int
) -> None:
    for looks in range(1, SETTINGS.jobs.attempts + 3):
        look(sessions)
        with sessions() as session:
            failed = session.get_one(Recording, stumbling)
            assert failed.failures == min(looks, SETTINGS.jobs.attempts)
            assert failed.state == ("stored" if looks < SETTINGS.jobs.attempts else "refused")
            assert "reading it failed" in (failed.reason or "")
            assert session.scalars(select(Recording).where(Recording.name == "sound")).one().state == "read"
            assert len(session.scalars(select(Event)).all()) == 2


@pytest.mark.parametrize("way", ["update", "version"])
def test_what_was_given_up_can_be_read_again(sessions: sessionmaker[Session], stumbling: int, way: str) -> None:
    for _ in range(SETTINGS.jobs.attempts):
        look(sessions)
    with sessions.begin() as session:
        session.execute(delete(Waveform).where(Waveform.samples == b"damaged"))
        if way == "update":
            building_store.update_description(session, building_file("folder", "/nowhere"), Path("/"), NOW)
        else:
            session.get_one(Recording, stumbling).version = "0.0.1"
    look(sessions)
    with sessions() as session:
        mended = session.get_one(Recording, stumbling)
        assert (mended.state, mended.reason, mended.failures) == ("read", None, 0)
        assert (mended.start, mended.version) == (START, VERSION)


TOO_MUCH = b"# start: 2024-01-01T00:00:00Z\n# rate: 100\nXX.TOWER.00.HNX [gal]\n" + b"0.5\n" * 4_000_000


def test_a_file_that_is_too_much_for_its_parser_is_given_up_and_holds_up_no_other(
    sessions: sessionmaker[Session],
) -> None:
    add(sessions, "folder", "/nowhere")
    hasty = Settings(**LIMITS, parser_time=0.3)
    with sessions.begin() as session:
        for name, data in (("long", TOO_MUCH), ("sound", miniseed(stream()))):
            store(session, building_store.find(session, "TOWER"), name, f"/{name}", kept(data), NOW)
    for looks in range(1, hasty.jobs.attempts + 3):
        SourcePoller(sessions, hasty, clock=lambda: NOW).poll_all()
        with sessions() as session:
            given_up, sound = session.scalars(select(Recording).order_by(Recording.name))
            assert (sound.state, sound.failures) == ("read", 0)
            assert given_up.failures == min(looks, hasty.jobs.attempts)
            assert given_up.state == ("stored" if looks < hasty.jobs.attempts else "refused")
            assert (given_up.reason or "").startswith("long takes more than 0.3 s to be read")


def test_a_database_that_goes_away_while_a_file_is_read_is_no_failure_of_the_file(
    sessions: sessionmaker[Session],
) -> None:
    add(sessions, "folder", "/nowhere")
    with sessions.begin() as session:
        store(session, building_store.find(session, "TOWER"), "a.mseed", "/a.mseed", kept(miniseed(stream())), NOW)
    poller = SourcePoller(sessions, SETTINGS, clock=lambda: NOW)

    def away(_: object, __: object, statement: str, *___: object) -> None:
        if statement.startswith("INSERT INTO waveform"):
            raise OperationalError(statement, {}, ConnectionError("the server closed the connection"))

    event.listen(sessions.kw["bind"], "before_cursor_execute", away)
    for _ in range(SETTINGS.jobs.attempts + 2):
        with pytest.raises(OperationalError):
            poller.poll_all()
        with sessions() as session:
            assert session.scalars(select(Recording.failures)).one() == 1
    event.remove(sessions.kw["bind"], "before_cursor_execute", away)
    poller.poll_all()
    with sessions() as session:
        recording = session.scalars(select(Recording)).one()
        assert (recording.state, recording.failures) == ("read", 0)


def test_a_file_over_which_the_service_ended_is_tried_a_few_times_only(sessions: sessionmaker[Session]) -> None:
    add(sessions, "folder", "/nowhere")
    with sessions.begin() as session:
        store(session, building_store.find(session, "TOWER"), "a.mseed", "/a.mseed", kept(miniseed(stream())), NOW)
    for _ in range(SETTINGS.jobs.attempts):
        with sessions.begin() as session:  # the service is killed after this
            assert begin(session, session.scalars(select(Recording)).one(), settings=SETTINGS)
    look(sessions)
    with sessions() as session:
        recording = session.scalars(select(Recording)).one()
        assert recording.state == "refused"
        assert (recording.reason or "").startswith("the service ended while it was read, 3 times")
    with sessions.begin() as session:
        building_store.update_description(session, building_file("folder", "/nowhere"), Path("/"), NOW)
    look(sessions)
    with sessions() as session:
        assert session.scalars(select(Recording)).one().state == "read"


@pytest.mark.parametrize("before", ["INSERT INTO event ", "UPDATE source_state", "INSERT INTO source_state"])
def test_whenever_the_service_ends_nothing_is_lost_and_one_attempt_is_counted_at_most(
    sessions: sessionmaker[Session], server: Server, before: str
) -> None:
    names = [f"{number}.mseed" for number in range(3)]
    server.pages["/events/"] = Page("\n".join(names).encode())
    for number, name in enumerate(names):
        server.add(f"/events/{name}", miniseed(stream(START + timedelta(hours=number))))
    add(sessions, "archive", f"{server.address}/events/")

    def end(*given: object) -> None:
        if str(given[2]).startswith(before):
            raise KeyboardInterrupt

    event.listen(sessions.kw["bind"], "before_cursor_execute", end)
    for _ in range(2):
        with suppress(KeyboardInterrupt):
            look(sessions)
        with sessions() as session:
            failures = session.scalars(select(Recording.failures)).all()
            assert sum(map(bool, failures)) <= 1
    event.remove(sessions.kw["bind"], "before_cursor_execute", end)
    look(sessions)
    look(sessions)
    with sessions() as session:
        assert [(one.state, one.failures) for one in session.scalars(select(Recording))] == [("read", 0)] * 3
        assert [one.state for one in session.scalars(select(Event))] == ["queued"] * 3
        assert len(session.scalars(select(Job)).all()) == 3


def test_a_new_file_is_stored_in_one_transaction_and_read_in_another(
    sessions: sessionmaker[Session], server: Server
) -> None:
    server.pages["/events/"] = Page(b"a.mseed")
    add(sessions, "archive", f"{server.address}/events/")
    server.add("/events/a.mseed", miniseed(stream()))
    done: list[str] = []
    engine = sessions.kw["bind"]

    def note(*given: object) -> None:
        done.append(str(given[2]).split("(")[0].strip() if len(given) > 2 else "COMMIT")

    for kind in ("before_cursor_execute", "commit"):
        event.listen(engine, kind, note)
    look(sessions)
    for kind in ("before_cursor_execute", "commit"):
        event.remove(engine, kind, note)
    parts = " ".join(f"{one};" for one in done).split("COMMIT;")
    at = {table: [n for n, part in enumerate(parts) if f"INSERT INTO {table};" in part + ";"] for table in TABLES}
    assert at["content"] == at["recording"] == at["fetched_file"]
    assert at["event"] == at["waveform"] == at["job"] == [at["content"][0] + 1]
    assert not [one for one in done if "content.data" in one], "the bytes are at hand"


def test_names_that_are_no_unicode_and_reasons_with_nul_hold_up_nothing(
    sessions: sessionmaker[Session], server: Server, tmp_path: Path
) -> None:
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / os.fsdecode(b"\xff.mseed")).write_bytes(miniseed(stream()))
    add(sessions, "folder", str(folder))
    later = datetime.now(START.tzinfo) + timedelta(minutes=1)
    look(sessions, later)
    with sessions() as session:
        recording = session.scalars(select(Recording)).one()
        assert (recording.name, recording.state) == ("\\udcff.mseed", "read")
    server.pages["/events/"] = Page(b"a%00b.mseed")
    server.pages["/events/a%00b.mseed"] = Page(b"# start: \0\n# rate: 1\n")
    with sessions.begin() as session:
        text = building_file("archive", f"{server.address}/events/").replace('"TOWER"', '"OTHER"', 1)
        building_store.add(session, text, Path("/"), NOW)
    look(sessions, later)
    with sessions() as session:
        recording = session.scalars(select(Recording).where(Recording.state == "refused")).one()
        assert recording.name == "a\N{REPLACEMENT CHARACTER}b.mseed"


def test_a_poll_that_finds_nothing_new_reads_once_and_writes_once(
    sessions: sessionmaker[Session], server: Server
) -> None:
    server.pages["/events/"] = Page(b"a.mseed")
    server.add("/events/a.mseed", miniseed(stream()))
    add(sessions, "archive", f"{server.address}/events/")
    for _ in range(3):  # the file has to be the same twice
        look(sessions)
    poller, statements = SourcePoller(sessions, SETTINGS, clock=lambda: NOW + timedelta(minutes=1)), list[str]()

    def note(*given: object) -> None:
        statements.append(str(given[2]))

    event.listen(sessions.kw["bind"], "before_cursor_execute", note)
    assert poller.poll("TOWER")
    event.remove(sessions.kw["bind"], "before_cursor_execute", note)
    found = [one.split()[0] for one in statements if not one.startswith("BEGIN")]
    assert found[0] == "SELECT"
    assert found[-1] == "UPDATE"
    assert set(found[1:-1]) <= {"SELECT"}, "the files that the listing names"
    assert len(found) <= 3
    assert state(sessions).attempted_at == state(sessions).succeeded_at == NOW + timedelta(minutes=1)


def test_the_first_state_of_a_source_may_be_added_by_two_at_once(
    sessions: sessionmaker[Session], server: Server
) -> None:
    """The poll itself, and the poller that notes that it lasts."""
    add(sessions, "archive", f"{server.address}/events/")
    poller = SourcePoller(sessions, SETTINGS, clock=lambda: NOW)
    with ThreadPoolExecutor(1) as pool:
        with sessions.begin() as session:
            before = source_state(session, session.scalars(select(Building)).one())
            session.flush()
            noted = pool.submit(poller.note_attempt, "TOWER", NOW)
            assert not wait([noted], 0.2).done, "it waits for this transaction"
            before.error = "slow"
        noted.result(30)
    assert (state(sessions).attempted_at, state(sessions).error) == (NOW, "slow")
    poller.note_attempt("GONE", NOW)


def test_a_poll_that_lasts_is_stored_as_begun(sessions: sessionmaker[Session], server: Server) -> None:
    add(sessions, "archive", f"{server.address}/events/")
    poller = SourcePoller(sessions, SETTINGS, clock=lambda: NOW)
    poller.note_attempt("TOWER", NOW)
    assert (state(sessions).attempted_at, state(sessions).succeeded_at) == (NOW, None)
    poller.note_attempt("TOWER", NOW - timedelta(minutes=1))
    assert state(sessions).attempted_at == NOW, "of an earlier poll"
