"""Connections to the database, alike for SQLite and PostgreSQL."""

import os
import shutil
import sqlite3
import stat
from pathlib import Path
from time import monotonic, sleep
from typing import Any
from weakref import WeakKeyDictionary

import sqlalchemy  # create_engine is looked up when it is called: service.tracing replaces it
from sqlalchemy import URL, Connection, Engine, event, make_url
from sqlalchemy.engine import ExceptionContext
from sqlalchemy.exc import DBAPIError, OperationalError
from sqlalchemy.orm import Session, sessionmaker

import service.access.tables
import service.alerts.tables
import service.analyses.tables
import service.buildings.tables
import service.drift.tables
import service.jobs.tables
import service.models.tables
import service.notify.tables
import service.records.tables
import service.verdict.tables  # noqa: F401  SQLAlchemy knows a table only once its module is imported
from service.db.problems import name

BUSY_TIMEOUT = 30.0  # s that a writer waits for another one
LOCKED_TIMEOUT = 1.0  # s that a new file may be locked while it is being created
STALLED = 30  # s after which a network to PostgreSQL that brings no answer counts as broken; by default two hours
KEEPALIVE = {
    "keepalives_idle": STALLED // 3,
    "keepalives_interval": STALLED // 3,
    "keepalives_count": 2,
    "tcp_user_timeout": 1000 * STALLED,
}
READING = "reading"
READERS: WeakKeyDictionary[sessionmaker[Session], sessionmaker[Session]] = WeakKeyDictionary()
"""The read-only sessions of each maker of sessions that is in use."""
READ_ONLY = "25006"
"""PostgreSQL's code of a transaction that may not write."""


class NulError(ValueError):
    """A text to be stored or searched for contains a NUL character, which PostgreSQL cannot store."""

    def __init__(self) -> None:
        super().__init__("A text contains a NUL character (U+0000), which cannot be stored. Remove it.")


def engine(url: str) -> Engine:
    """The engine of a database; the folder of an SQLite file is created if necessary. Errors name the database."""
    address = _address(url)
    if address.get_backend_name() == "sqlite":
        made = _sqlite(address)
    else:
        made = sqlalchemy.create_engine(
            address, pool_pre_ping=True, hide_parameters=True, connect_args={"connect_timeout": 10} | KEEPALIVE
        )
    event.listen(made, "before_cursor_execute", _refuse_nul)
    event.listen(made, "handle_error", _as_on_sqlite, retval=True)
    return made


def sessions(url: str) -> sessionmaker[Session]:
    """Sessions that may write; objects stay readable after the commit."""
    return sessionmaker(engine(url), expire_on_commit=False)


def reading(sessions: sessionmaker[Session]) -> sessionmaker[Session]:
    """Read-only sessions; on SQLite they never wait for a writer.

    They are made once: each `sessionmaker` makes a class, which takes longer than a short query.
    """
    made = READERS.get(sessions)
    if made is None:
        bound = sessions.kw["bind"].execution_options(**{READING: True})
        made = READERS[sessions] = sessionmaker(bound, expire_on_commit=False)
    return made


def _as_on_sqlite(context: ExceptionContext) -> DBAPIError | None:
    """Name the database of an error; an OperationalError instead wherever waiting may help, as SQLite raises.

    psycopg raises others for a transaction that may not write, and for a connection that was lost earlier.
    """
    error = context.sqlalchemy_exception
    if error is None or context.engine is None:
        return None
    name(error, context.engine.url)
    if isinstance(error, OperationalError) or not isinstance(error, DBAPIError):
        return None
    if not context.is_disconnect and getattr(error.orig, "sqlstate", None) != READ_ONLY:
        return None
    passing = OperationalError(
        error.statement,
        error.params,
        error.orig or error,
        hide_parameters=error.hide_parameters,
        connection_invalidated=context.is_disconnect,
        ismulti=error.ismulti,
    )
    name(passing, context.engine.url)
    return passing


def _address(url: str) -> URL:
    address = make_url(url)
    return address.set(drivername="postgresql+psycopg") if address.drivername == "postgresql" else address


def _sqlite(address: URL) -> Engine:
    if address.database and address.database != ":memory:" and not address.database.startswith("file:"):
        _keep_to_the_owner(Path(address.database))
    waits = {} if "timeout" in address.query else {"timeout": BUSY_TIMEOUT}
    made = sqlalchemy.create_engine(address, hide_parameters=True, connect_args=waits)
    event.listen(made, "connect", _prepare)
    event.listen(made, "begin", _begin)
    return made


def _keep_to_the_owner(file: Path) -> None:
    """Make a new database file and its folder private to the owner; remove others' access to an existing file.

    SQLite gives its journals the rights of the file. The group's rights on an existing file stay, because they were
    set on purpose.
    """
    file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    try:
        os.close(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
    except FileExistsError:
        rights = stat.S_IMODE(file.stat().st_mode)
        if rights & stat.S_IRWXO and os.access(file, os.W_OK) and file.stat().st_uid == os.geteuid():
            file.chmod(rights & ~stat.S_IRWXO)
    except OSError:
        pass  # SQLite explains why a file cannot be opened


def _prepare(connection: Any, _: object) -> None:  # noqa: ANN401  the driver's own type
    connection.isolation_level = None  # the driver begins transactions too late: two readers could deadlock as writers
    if not connection.execute("PRAGMA page_count").fetchone()[0]:  # a file with pages would be locked for writing
        connection.execute("PRAGMA auto_vacuum=INCREMENTAL")  # an old file has it after a VACUUM
    _write_ahead(connection)
    for pragma in ("synchronous=FULL", "foreign_keys=ON"):  # FULL: what is committed outlives a loss of power
        connection.execute(f"PRAGMA {pragma}")


def _write_ahead(connection: sqlite3.Connection) -> None:
    """Set the write-ahead log. SQLite does not wait for a lock here: of two processes with a new file one must try
    again."""
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


def _refuse_nul(_: Connection, __: object, ___: str, parameters: Any, *____: object) -> None:  # noqa: ANN401
    """Refuse NUL characters before the driver does, with the same error for both databases."""
    rows = parameters if isinstance(parameters, list) else [parameters]
    for row in rows:
        for value in row.values() if isinstance(row, dict) else row:
            if isinstance(value, str) and "\0" in value:
                raise NulError


def _begin(connection: Connection) -> None:
    reads = connection.get_execution_options().get(READING, False)
    connection.exec_driver_sql("BEGIN" if reads else "BEGIN IMMEDIATE")


def free_bytes(session: Session) -> int | None:
    """Free bytes on the disk of the database file; None for a server."""
    address = session.get_bind().engine.url
    if address.get_backend_name() != "sqlite" or not address.database or address.database == ":memory:":
        return None
    return shutil.disk_usage(Path(address.database).parent).free
