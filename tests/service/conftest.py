"""A database for every test: SQLite, and for what depends on the database also a real PostgreSQL."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import databases
import pytest
import shared_statements
from sqlalchemy.orm import Session, sessionmaker

from service.db import sessions as opened

shared_statements.share()


@pytest.fixture(scope="session")
def postgres() -> Iterator[str]:
    """Address of a PostgreSQL server that lives as long as the test run."""
    with databases.own_server() as server:
        databases.prepare(server.get_uri())
        yield server.get_uri()


@pytest.fixture
def stoppable_postgres() -> Iterator[Any]:
    """A PostgreSQL server that a test may stop and start."""
    with databases.own_server() as server:
        yield server


@pytest.fixture
def postgres_database_url(postgres: str) -> Iterator[str]:
    """Address of a database of PostgreSQL without a table."""
    with databases.postgresql(postgres, "template0") as address:
        yield address


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Each test on both databases, on SQLite alone where its module is marked `sqlite`."""
    chosen = (mark.args[0] for mark in metafunc.definition.iter_markers("parametrize"))
    if "database_kind" in metafunc.fixturenames and "database_kind" not in chosen:
        marked = metafunc.definition.get_closest_marker("sqlite")
        metafunc.parametrize("database_kind", ["sqlite"] if marked else ["sqlite", "postgresql"], indirect=True)


@pytest.fixture
def own_settings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A working folder of the test's own, and no settings of the user who runs it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)


@pytest.fixture
def database_kind(request: pytest.FixtureRequest) -> str:
    """SQLite or PostgreSQL."""
    found: str = request.param
    return found


@pytest.fixture
def empty_database_url(database_kind: str, request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """Address of a database without a table."""
    if database_kind == "sqlite":
        return f"sqlite:///{tmp_path / 'menshin.sqlite'}"
    found: str = request.getfixturevalue("postgres_database_url")
    return found


@pytest.fixture
def database_url(database_kind: str, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """Address of a database with our tables and no row."""
    if database_kind == "sqlite":
        yield databases.sqlite(tmp_path)
        return
    with databases.postgresql(request.getfixturevalue("postgres")) as address:
        yield address


@pytest.fixture
def sessions(database_url: str) -> Iterator[sessionmaker[Session]]:
    """Sessions at a database with our tables and no row."""
    made = opened.sessions(database_url)
    yield made
    made.kw["bind"].dispose()
