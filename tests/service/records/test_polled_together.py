"""Polls of many quiet sources: few statements, and the same states as of single polls."""

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import timedelta
from pathlib import Path

import pytest
from monitoring_server import START, Page, Server, building_file, monitoring_server
from sqlalchemy import event, select
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.records import polled_together
from service.records.source_poller import SourcePoller
from service.records.tables import SourceState
from service.settings import Settings

NOW = START + timedelta(days=1)
LATER = NOW + timedelta(minutes=1)
SETTINGS = Settings(http_timeout=10, http_retries=0)
CODES = [f"B{number}" for number in range(30)]


@pytest.fixture
def server() -> Iterator[Server]:
    with monitoring_server() as server:
        server.pages["/events/"] = Page(b"")
        yield server


@pytest.fixture
def waiting() -> list[str]:
    """Codes of the sources that are polled next."""
    return []


@pytest.fixture
def poller(sessions: sessionmaker[Session], server: Server, waiting: list[str]) -> SourcePoller:
    """A poller of thirty quiet sources, all of which were polled once, by another one."""
    with sessions.begin() as session:
        for code in CODES:
            text = building_file("archive", f"{server.address}/events/").replace('"TOWER"', f'"{code}"', 1)
            building_store.add(session, text, Path("/"), NOW)
    SourcePoller(sessions, SETTINGS, clock=lambda: NOW).poll_all()
    return SourcePoller(sessions, SETTINGS, clock=lambda: LATER, waiting=lambda most: waiting[:most])


@contextmanager
def counted(sessions: sessionmaker[Session]) -> Iterator[list[str]]:
    """First words of the statements since then."""
    words: list[str] = []

    def note(*given: object) -> None:
        words.append(str(given[2]).split()[0])

    event.listen(sessions.kw["bind"], "before_cursor_execute", note)
    yield words
    event.remove(sessions.kw["bind"], "before_cursor_execute", note)


def polled_at(sessions: sessionmaker[Session]) -> list[object]:
    with sessions() as session:
        return list(session.scalars(select(SourceState.succeeded_at).order_by(SourceState.building_id)))


def poll_all(poller: SourcePoller, waiting: list[str]) -> None:
    """Poll each source in turn, while the later ones wait."""
    waiting[:] = CODES
    while waiting:
        assert poller.poll(waiting.pop(0))


@pytest.fixture
def timer(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """s that the timer shows, so that no count depends on the speed of the machine."""
    shown = [0.0]
    monkeypatch.setattr(polled_together, "monotonic", lambda: shown[0])
    return shown


@pytest.mark.usefixtures("timer")
@pytest.mark.parametrize(("many", "reads", "writes"), [(50, 1, 1), (10, 3, 3)])
def test_sources_that_wait_are_read_and_stored_together(
    sessions: sessionmaker[Session],
    poller: SourcePoller,
    waiting: list[str],
    many: int,
    reads: int,
    writes: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(polled_together, "MANY", many)
    with counted(sessions) as words:
        poll_all(poller, waiting)
    assert (words.count("SELECT"), words.count("UPDATE")) == (reads, writes)
    assert polled_at(sessions) == [LATER] * len(CODES)


def test_neither_a_state_nor_an_end_is_kept_for_long(
    sessions: sessionmaker[Session], poller: SourcePoller, waiting: list[str], timer: list[float]
) -> None:
    waiting[:] = CODES[1:]
    assert poller.poll("B0")
    assert set(polled_at(sessions)) == {NOW}, "it waits to be stored with others"
    timer[0] += polled_together.FRESH
    with counted(sessions) as words:
        assert poller.poll("B1")
    assert (words.count("SELECT"), words.count("UPDATE")) == (1, 1), "read again, and both ends stored"
    assert polled_at(sessions)[:3] == [LATER, LATER, NOW]


def test_an_end_that_could_not_be_stored_is_stored_later(sessions: sessionmaker[Session], poller: SourcePoller) -> None:
    def refuse(*given: object) -> None:
        if str(given[2]).startswith("UPDATE"):
            raise OperationalError("UPDATE", {}, Exception("the database is away"))

    event.listen(sessions.kw["bind"], "before_cursor_execute", refuse)
    with pytest.raises(OperationalError):
        poller.poll("B3")
    event.remove(sessions.kw["bind"], "before_cursor_execute", refuse)
    assert set(polled_at(sessions)) == {NOW}
    poller.together.store()
    assert polled_at(sessions) == [LATER if code == "B3" else NOW for code in CODES]


def test_a_source_that_begins_to_fail_is_stored_at_once_and_so_is_one_that_works_again(
    sessions: sessionmaker[Session], poller: SourcePoller, server: Server, waiting: list[str]
) -> None:
    waiting[:] = CODES[1:]
    server.pages["/events/"], page = Page(status=500), server.pages["/events/"]
    assert not poller.poll("B0")
    with sessions() as session:
        assert session.get_one(SourceState, 1).failing_since == LATER
    server.pages["/events/"] = page
    assert poller.poll("B0")
    with sessions() as session:
        assert session.get_one(SourceState, 1).failing_since is None


def test_an_end_that_waits_to_be_stored_does_not_hide_a_later_failure(
    sessions: sessionmaker[Session], poller: SourcePoller, server: Server, waiting: list[str]
) -> None:
    waiting[:] = CODES[1:]
    assert poller.poll("B0")
    assert set(polled_at(sessions)) == {NOW}, "it waits"
    server.pages["/events/"] = Page(status=500)
    assert not poller.poll("B0")
    poller.together.store()
    with sessions() as session:
        assert session.get_one(SourceState, 1).failing_since == LATER
