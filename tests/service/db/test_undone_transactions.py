"""A transaction that PostgreSQL undoes because of another one is repeated, and the log does not call that an outage."""

import logging
from collections.abc import Callable
from datetime import UTC, datetime

import orjson
import pytest
from at_once import interleave
from fastapi import Request
from sqlalchemy import Engine, select, update
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service.buildings.tables import Building
from service.db.problems import Attempts, problem, undone
from service.http.problems import database_problem

pytestmark = pytest.mark.parametrize("database_kind", ["postgresql"], indirect=True)

NOW = datetime(2024, 1, 1, tzinfo=UTC)
FIRST, SECOND = "FIRST", "SECOND"


@pytest.fixture
def buildings(sessions: sessionmaker[Session]) -> sessionmaker[Session]:
    """Sessions at a database with two buildings."""
    with sessions.begin() as session:
        session.add_all([Building(code=code, name="tower", created_at=NOW) for code in (FIRST, SECOND)])
    return sessions


def rename(sessions: sessionmaker[Session], *codes: str) -> None:
    with sessions.begin() as session:
        for code in codes:
            session.execute(update(Building).where(Building.code == code).values(name=f"new, {codes[0]} first"))


def deadlock(sessions: sessionmaker[Session]) -> None:
    """Two transactions, of which each waits for the other."""
    both = lambda: rename(sessions, FIRST, SECOND), lambda: rename(sessions, SECOND, FIRST)
    interleave(sessions, both[0], "UPDATE building", both[1])


def failed_serialization(sessions: sessionmaker[Session]) -> None:
    """A transaction changes a row that another one has changed since it began."""
    bound: Engine = sessions.kw["bind"]
    snapshot = sessionmaker(bound.execution_options(isolation_level="REPEATABLE READ"))
    with snapshot.begin() as session:
        assert session.scalar(select(Building.name).where(Building.code == FIRST)) == "tower"
        rename(sessions, FIRST)
        session.execute(update(Building).where(Building.code == FIRST).values(name="mill"))


@pytest.mark.parametrize(
    ("conflict", "words"),
    [
        (deadlock, "it and another transaction waited for each other"),
        (failed_serialization, "it and another transaction changed the same rows"),
    ],
    ids=["deadlock", "serialization"],
)
def test_everyone_reads_what_happened(
    buildings: sessionmaker[Session],
    conflict: Callable[[sessionmaker[Session]], None],
    words: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    attempts = Attempts(logging.getLogger("part"))
    with attempts.one():
        conflict(buildings)
    assert attempts.pause(1.0) == 1.0, "the database answers: there is no reason to wait longer"
    with attempts.one():
        rename(buildings, FIRST, SECOND)
    (line,) = [record.getMessage() for record in caplog.records if record.name == "part"]
    assert line.startswith(f"the database undid a transaction, because {words}; it is repeated")
    assert "cannot be used" not in line


def test_a_person_is_advised_to_try_again(buildings: sessionmaker[Session]) -> None:
    with pytest.raises(OperationalError) as caught:
        failed_serialization(buildings)
    reason = undone(caught.value)
    assert reason is not None
    shown = problem(caught.value)
    assert shown is not None
    assert shown.endswith(f"undid this transaction, because {reason}; try again")
    answer = database_problem(Request({"type": "http"}), caught.value)
    assert (answer.status_code, answer.headers["Retry-After"]) == (503, "5")
    assert "Another change of the same data" in orjson.loads(answer.body)["detail"]


def test_a_database_that_undoes_a_transaction_is_back(
    buildings: sessionmaker[Session], caplog: pytest.LogCaptureFixture
) -> None:
    attempts = Attempts(logging.getLogger("part"))
    with attempts.one():
        raise OperationalError("SELECT 1", {}, ConnectionError("connection refused"))
    with attempts.one():
        failed_serialization(buildings)
    away, back, repeated = [record.getMessage() for record in caplog.records if record.name == "part"]
    assert away.startswith("the database cannot be used, trying again: ")
    assert back == "the database is back"
    assert repeated.startswith("the database undid a transaction, ")
