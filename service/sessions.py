"""How the database is reached: the same way for SQLite and PostgreSQL."""

import sqlite3
from pathlib import Path
from time import monotonic, sleep
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event, make_url
from sqlalchemy.orm import Session, sessionmaker

BUSY_TIMEOUT = 30.0  # s that a writer waits for the other one
LOCKED_TIMEOUT = 1.0  # s that a file which is being made may be locked
READING = "reading"


def engine(url: str) -> Engine:
    """The engine of a database; the folder of an SQLite file is made if it is missing."""
    address = _address(url)
    if address.get_backend_name() == "sqlite":
        return _sqlite(address)
    return create_engine(address, pool_pre_ping=True, connect_args={"connect_timeout": 10})


def sessions(url: str) -> sessionmaker[Session]:
    """Sessions that may write; objects stay readable after the commit."""
    return sessionmaker(engine(url), expire_on_commit=False)


def reading(sessions: sessionmaker[Session]) -> sessionmaker[Session]:
    """The same sessions for readers: on SQLite these never wait for a writer, and must not write."""
    bound = sessions.kw["bind"]
    return sessionmaker(bound.execution_options(**{READING: True}), expire_on_commit=False)


def _address(url: str) -> URL:
    address = make_url(url)
    return address.set(drivername="postgresql+psycopg") if address.drivername == "postgresql" else address


def _sqlite(address: URL) -> Engine:
    if address.database and address.database != ":memory:":
        Path(address.database).parent.mkdir(parents=True, exist_ok=True)
    waits = {} if "timeout" in address.query else {"timeout": BUSY_TIMEOUT}
    made = create_engine(address, connect_args=waits)
    event.listen(made, "connect", _prepare)
    event.listen(made, "begin", _begin)
    return made


def _prepare(connection: Any, _: object) -> None:  # noqa: ANN401  the driver's own, without a type of SQLAlchemy's
    connection.isolation_level = None  # the driver would begin too late and let two readers deadlock as writers
    _write_ahead(connection)
    for pragma in ("synchronous=NORMAL", "foreign_keys=ON"):
        connection.execute(f"PRAGMA {pragma}")


def _write_ahead(connection: sqlite3.Connection) -> None:
    """Of two processes that find the file new, one is told that it is locked: SQLite does not wait here by itself."""
    end = monotonic() + LOCKED_TIMEOUT
    while True:
        try:
            connection.execute("PRAGMA journal_mode=WAL")
        except sqlite3.OperationalError:
            if monotonic() > end:
                raise
            sleep(0.01)
        else:
            return


def _begin(connection: Connection) -> None:
    reads = connection.get_execution_options().get(READING, False)
    connection.exec_driver_sql("BEGIN" if reads else "BEGIN IMMEDIATE")
