"""Servers that accept a connection and stay silent hold up neither the other sources nor the end of the service."""

import socket
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, datetime
from pathlib import Path
from threading import Event as Signal
from time import monotonic, sleep

import databases
import pytest
from monitoring_server import Page, Server, building_file, monitoring_server
from processes import interrupt, running_command
from sqlalchemy import func, select
from sqlalchemy.orm import InstrumentedAttribute, Session, sessionmaker

from service.buildings import store as building_store
from service.db import sessions as opened
from service.records import source_schedule
from service.records.source_schedule import SourceSchedule
from service.records.tables import SourceState

NOW = datetime(2024, 1, 1, tzinfo=UTC)
STALLED, SOURCES = 12, 100
INTERVAL = 240.0
TIMEOUT = 2 * INTERVAL
PATIENT = {"MENSHIN_POLLING__INTERVAL": str(INTERVAL), "MENSHIN_POLLING__TIMEOUT": str(TIMEOUT)}
"""s between two looks; a look takes 30 ms of a processor's time, of which a busy machine gives it a twentieth."""
ENDS = 30.0
"""s to end, beyond those that looks are given: seconds of processor time, and far less than a silent server's."""


@pytest.fixture
def silent() -> Iterator[str]:
    """Address of a server that accepts connections and never answers."""
    with closing(socket.create_server(("127.0.0.1", 0), backlog=4 * STALLED)) as server:
        yield f"http://127.0.0.1:{server.getsockname()[1]}/events/"


@pytest.fixture
def answering() -> Iterator[Server]:
    with monitoring_server() as server:
        server.pages["/events/"] = Page(b"\n")
        yield server


@pytest.mark.slow
def test_the_other_sources_are_looked_at_in_time_and_the_service_ends_soon(
    silent: str, answering: Server, tmp_path: Path
) -> None:
    url = databases.sqlite(tmp_path)
    sessions = opened.sessions(url)
    with sessions.begin() as session:
        for number in range(SOURCES):  # those that stall come first by their code
            where = silent if number < STALLED else f"{answering.address}/events/"
            text = building_file("archive", where).replace('"TOWER"', f'"B{number:03}"')
            building_store.add(session, text, Path("/"), NOW)
    with running_command(tmp_path, url, "poll", **PATIENT) as poller:
        until(lambda: count(sessions, SourceState.attempted_at) > 0, 120)
        until(lambda: count(sessions, SourceState.succeeded_at) == SOURCES - STALLED, INTERVAL)
        assert count(sessions, SourceState.failing_since) == 0, "none of the silent ones has been given up yet"
        began = monotonic()
        assert interrupt(poller) == 0
        assert monotonic() - began < source_schedule.TO_END + ENDS < TIMEOUT
    assert "B000, B001" in (tmp_path / "output").read_text(), "the sources that were not waited for are named"
    sessions.kw["bind"].dispose()


def count(sessions: sessionmaker[Session], reported: InstrumentedAttribute[datetime | None]) -> int:
    with sessions() as session:
        return session.scalar(select(func.count()).where(reported.is_not(None))) or 0


def until(met: Callable[[], bool], seconds: float) -> None:
    end = monotonic() + seconds
    while not met():
        assert monotonic() < end, "it did not happen in time"
        sleep(0.05)


class Sources:
    """Sources whose looks end when they are let go, and a timer that is moved by hand."""

    def __init__(self, interval: float) -> None:
        self.now = 0.0
        self.looked: list[str] = []
        self.ends: dict[str, Signal] = {}
        self.answers = True
        self.schedule = SourceSchedule(self.look, interval, lambda: self.now)

    def look(self, code: str) -> bool:
        self.looked.append(code)
        if code in self.ends:
            self.ends[code].wait(30)
        return self.answers

    def stall(self, *codes: str) -> None:
        self.ends |= {code: Signal() for code in codes}

    def due(self, *codes: str) -> list[str]:
        """The sources at which a look began as these became due."""
        before = len(self.looked)
        for code in codes:
            self.schedule.due(code)
        until(self._only_stalled_ones_run, 30)
        return sorted(self.looked[before:])

    def _only_stalled_ones_run(self) -> bool:
        with self.schedule.lock:
            return all(code in self.ends and code in self.looked for code in self.schedule.running)

    def let_go(self) -> None:
        for end in self.ends.values():
            end.set()
        until(lambda: not self.schedule.running, 5)


def codes(kind: str, number: int) -> list[str]:
    return [f"{kind}{one:02}" for one in range(number)]


def test_a_look_that_lasts_gives_its_place_to_another() -> None:
    sources = Sources(interval=60)
    sources.stall(*codes("a", 50))
    assert sources.due(*codes("a", 50)) == codes("a", source_schedule.QUICK)
    sources.now = source_schedule.LASTING
    assert sources.due("b") == codes("a", 2 * source_schedule.QUICK)[source_schedule.QUICK :], (
        "in the order in which they came due"
    )
    sources.now = 10 * source_schedule.LASTING
    assert len(sources.due("b")) == source_schedule.TOGETHER - 2 * source_schedule.QUICK, "but there is an end to it"
    assert sources.due("a00", "a00") == [], "no source is looked at twice at a time"
    sources.let_go()
    until(lambda: "b" in sources.looked, 5)
    assert sorted(sources.looked) == [*codes("a", 50), "b"]


def test_failing_sources_have_places_of_their_own() -> None:
    sources = Sources(interval=60)
    failing = codes("f", 20)
    sources.stall(*failing)
    sources.schedule.expect_failure(failing)
    assert sources.due(*failing, *codes("g", 30)) == codes("f", source_schedule.FAILING) + codes("g", 30)
    sources.let_go()


def test_a_failing_source_rests_ever_longer_until_it_answers() -> None:
    sources = Sources(interval=60)
    sources.answers = False
    times = []
    for minute in range(31):
        sources.now = 60.0 * minute
        times += [minute for _ in sources.due("a")]
    assert times == [0, 1, 3, 7, 12, 17, 22, 27]
    sources.answers = True
    sources.now = 60.0 * 32
    assert sources.due("a") == ["a"]
    sources.now = 60.0 * 33
    assert sources.due("a") == ["a"]


def test_shutdown_waits_briefly_and_names_sources_that_did_not_answer() -> None:
    sources = Sources(interval=60)
    sources.stall("a")
    sources.due("a", "b")
    began = monotonic()
    assert sources.schedule.end() == ["a"]
    assert monotonic() - began < source_schedule.TO_END + 7.0, "the look ends by itself after 30 s"
    assert sources.due("c") == []
    sources.let_go()


def test_sources_that_wait_are_not_gone_through_again_and_again() -> None:
    """Ten thousand become due at once when a poller starts: a poll that ends must not cost as much as all that wait."""
    sources, readings = Sources(interval=60), 0
    sources.stall(*codes("a", 50))
    sources.due(*codes("a", 50))  # no place is left

    def timer() -> float:
        nonlocal readings
        readings += 1
        return 0.0

    sources.schedule.timer = timer
    for number in range(300):
        sources.schedule.due(f"b{number:03}")
    sources.let_go()
    until(lambda: len(sources.looked) == 350, 30)
    assert readings < 350 * (source_schedule.TOGETHER + 10)
