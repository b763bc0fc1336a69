"""Why a database cannot be used, in one or two lines: what was found, and what helps. No line repeats a password."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from logging import Logger

from sqlalchemy import URL, make_url
from sqlalchemy.exc import (
    ArgumentError,
    DataError,
    DBAPIError,
    IntegrityError,
    OperationalError,
    SQLAlchemyError,
    TimeoutError as PoolTimeoutError,
)

ALLOWED = "sqlite:///file or postgresql://user:password@host/name is"
DRIVERS = frozenset({"sqlite", "sqlite+pysqlite", "postgresql", "postgresql+psycopg"})

OF_SQLITE: dict[str, tuple[str, str]] = {
    "unable to open database file": (
        "cannot be opened",
        "check that its path names a file, and that this account may write to it and to its folder",
    ),
    "readonly database": ("is read-only", "give this account the right to write to it and to its folder"),
    "file is not a database": ("is not an SQLite database", "name another file, or move this one away"),
    "malformed": ("is damaged", "restore it from a backup"),
    "disk is full": ("is on a disk that is full", "make room"),
    "disk i/o error": ("cannot be written: the disk is full, or fails", "make room, or check the disk"),
    "database is locked": ("is in use by another process, which did not give it free", "try again once that has ended"),
}
OF_POSTGRESQL: dict[str, tuple[str, str]] = {
    "connection refused": ("cannot be reached: no server listens there", "check host and port, and start the server"),
    "could not translate host name": ("cannot be reached: the host is not known", "check the host in database_url"),
    "name or service not known": ("cannot be reached: the host is not known", "check the host in database_url"),
    "failed to resolve host": ("cannot be reached: the host is not known", "check the host in database_url"),
    "no such file or directory": ("cannot be reached: no server listens there", "check host, and start the server"),
    "timeout expired": ("did not answer in time", "check host and port, and that the server runs"),
    "timed out": ("did not answer in time", "check host and port, and that the server runs"),
    "starting up": ("is starting up", "try again in a moment"),
    "shutting down": ("is shutting down", "start the server"),
    "too many": ("has too many connections", "end some, or raise max_connections of the server"),
    "closed the connection unexpectedly": ("broke the connection off", "check that the server runs"),
    "password authentication failed": ("refuses the login", "correct user and password in database_url"),
    "no password supplied": ("refuses the login: no password is given", "add the password to database_url"),
    "pg_hba.conf": ("refuses the login from this machine", "allow it in the server's pg_hba.conf"),
    "no space left on device": ("is on a disk that is full", "make room"),
    "could not extend file": ("is on a disk that is full", "make room"),
    "read-only": ("is read-only", "use the primary server, or allow writing"),
    "permission denied": ("denies this user the right", "grant the user all rights on the database and its schema"),
}
"""By a part of what the driver says, in small letters."""
OF_BOTH: dict[str, tuple[str, str]] = {
    "no such table": ("lacks tables of this version", "name another database, or restore this one from a backup"),
    "no such column": ("lacks columns of this version", "name another database, or restore this one from a backup"),
    "already exists": ("has tables that menshin did not make", "name another database: menshin makes its own tables"),
    "does not exist": ("does not exist, or lacks a table or a user", "make it, or correct database_url"),
}
PASSING = (
    *("connection refused", "could not translate", "name or service not known", "failed to resolve host"),
    *("no such file or directory", "timeout expired", "timed out", "starting up", "shutting down", "too many"),
    *("closed the connection", "database is locked"),
)
"""Parts of what a driver says while the database is only away, or busy, and may come back."""
NOTE = "about: "
"""Begins the note that says which database an error is about."""


class DatabaseVersionError(Exception):
    """A database of another version of menshin; the message says what was found and what helps."""


def wrong_address(address: str) -> str | None:
    """What is wrong with the address of a database, without repeating it; None if it may be one."""
    try:
        url = make_url(address)
    except (ArgumentError, ValueError):  # of a port that is no number
        return f"this is not the address of a database; {ALLOWED}"
    if url.drivername not in DRIVERS:
        return f"{url.drivername!r} is not a kind of database that menshin uses; {ALLOWED}"
    if url.get_backend_name() == "sqlite" and url.host:
        return "an SQLite file is named after three slashes, as in sqlite:///menshin.sqlite or sqlite:////srv/menshin.sqlite"
    return None


def problem(error: SQLAlchemyError) -> str | None:
    """What is wrong with a database, by an error of SQLAlchemy; None where the error is a bug of ours."""
    if isinstance(error, ArgumentError):
        return f"database_url is not the address of a database; {ALLOWED}"
    if isinstance(error, PoolTimeoutError):
        return f"{_name(error)} is busy; try again later"
    if not isinstance(error, DBAPIError) or isinstance(error, IntegrityError | DataError):
        return None
    of_file = type(error.orig).__module__.startswith("sqlite3")
    for part, (found, helps) in ((OF_SQLITE if of_file else OF_POSTGRESQL) | OF_BOTH).items():
        if part in _said(error).lower():
            return f"{_name(error)} {found}; {helps}"
    if isinstance(error, OperationalError) and not of_file:
        return f"{_name(error)} cannot be used: {_said(error)}"
    return None


def is_away(error: SQLAlchemyError) -> bool:
    """Whether waiting may help: the server does not answer, or is busy; anything else takes a person."""
    if isinstance(error, PoolTimeoutError):
        return True
    return isinstance(error, DBAPIError) and any(part in _said(error).lower() for part in PASSING)


def _said(error: DBAPIError) -> str:
    return " ".join(str(error.orig).split())


def name(error: BaseException, url: URL) -> None:
    """Note with an error which database it is about."""
    error.add_note(f"{NOTE}{shown(url)}")


def shown(url: URL) -> str:
    """A database as it may be shown: the file, or the server and the name."""
    if url.get_backend_name() == "sqlite":
        return f"the database {url.database or 'in memory'}"
    port = "" if url.port is None else f":{url.port}"
    return f"the database {url.database or ''} at {url.host or 'this machine'}{port}"


def _name(error: BaseException) -> str:
    notes = getattr(error, "__notes__", [])
    return next((note.removeprefix(NOTE) for note in notes if note.startswith(NOTE)), "the database")


LONGEST_PAUSE = 30.0
"""s between two attempts at a database that is away."""
MOST_DOUBLINGS = 30
"""Of a pause, which is the longest by then: a number stays one, however long the database is away."""


@dataclass(slots=True)
class Attempts:
    """One after the other at a database that may go away, and come back."""

    log: Logger
    failed: int = 0
    """How many in a row found no database."""

    @contextmanager
    def one(self) -> Iterator[None]:
        """One of them, which ends early where the database does not answer; any other error is raised."""
        try:
            yield
        except OperationalError as error:
            if not self.failed:
                self.log.warning("the database is out of reach, trying again: %s", error.orig)
            self.failed += 1
        else:
            if self.failed:
                self.log.warning("the database is back")
            self.failed = 0

    def pause(self, usual: float) -> float:
        """s before the next one: `usual` while the database answers, twice as long after each attempt that failed."""
        return min(usual * 2.0 ** min(self.failed, MOST_DOUBLINGS), LONGEST_PAUSE)
