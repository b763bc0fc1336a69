"""Database errors in one or two lines: the problem and its remedy. No line repeats a password."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from logging import Logger
from pathlib import Path

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

ALLOWED = "use sqlite:///file or postgresql://user:password@host/name"
DRIVERS = frozenset({"sqlite", "sqlite+pysqlite", "postgresql", "postgresql+psycopg"})

OF_SQLITE: dict[str, tuple[str, str]] = {
    "unable to open database file": (
        "cannot be opened",
        "check that its path names a file, and that this account may write to it and to its folder",
    ),
    "readonly database": ("is read-only", "give this account the right to write to it and to its folder"),
    "file is not a database": ("is not an SQLite database", "name another file, or move this one away"),
    "malformed": ("is damaged", "restore it from a backup"),
    "disk is full": ("is on a full disk", "free some space"),
    "disk i/o error": ("cannot be written: the disk is full or failing", "free some space, or check the disk"),
    "database is locked": (
        "is in use by another process, which has not released it",
        "try again when that process has ended",
    ),
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
    "too many": ("has too many connections", "close some, or raise the server's max_connections"),
    "closed the connection unexpectedly": ("closed the connection", "check that the server runs"),
    "password authentication failed": ("refuses the login", "correct user and password in database_url"),
    "no password supplied": ("refuses the login: no password is given", "add the password to database_url"),
    "pg_hba.conf": ("refuses the login from this machine", "allow it in the server's pg_hba.conf"),
    "no space left on device": ("is on a full disk", "free some space"),
    "could not extend file": ("is on a full disk", "free some space"),
    "read-only": ("is read-only", "use the primary server, or allow writing"),
    "permission denied": ("denies this user the right", "grant the user all rights on the database and its schema"),
}
"""Problem and remedy by a part of the driver's message, in lower case."""
OF_BOTH: dict[str, tuple[str, str]] = {
    "no such table": ("lacks tables of this version", "name another database, or restore this one from a backup"),
    "no such column": ("lacks columns of this version", "name another database, or restore this one from a backup"),
    "already exists": ("has tables of another program", "name another database: Menshin creates its own tables"),
    "does not exist": ("does not exist, or lacks a table or a user", "create it, or correct database_url"),
}
PASSING = (
    *("connection refused", "could not translate", "name or service not known", "failed to resolve host"),
    *("no such file or directory", "timeout expired", "timed out", "starting up", "shutting down", "too many"),
    *("closed the connection", "database is locked"),
)
"""Parts of drivers' messages for temporary problems: the database does not answer or is busy."""
UNDONE: dict[str, str] = {
    "40P01": "it and another transaction waited for each other",
    "40001": "it and another transaction changed the same rows",
}
"""Reason why PostgreSQL undoes a transaction that can be repeated, by its code: a deadlock, a failed serialization."""
NOTE = "about: "
"""Prefix of the note that names the database of an error."""
THE_DATABASE = "the database "
"""Beginning of a database for display."""
WRITABLE = "make it writable, or name a path on another one in database_url"
"""Remedy for a read-only file system."""


class DatabaseVersionError(Exception):
    """The database belongs to another version of Menshin; the message states the problem and its remedy."""


def wrong_address(address: str) -> str | None:
    """The problem with the address of a database, without repeating it; None if it is valid."""
    try:
        url = make_url(address)
    except (ArgumentError, ValueError):  # the port is not a number
        return f"this is not the address of a database; {ALLOWED}"
    if url.drivername not in DRIVERS:
        return f"{url.drivername!r} is not a kind of database that menshin uses; {ALLOWED}"
    if url.get_backend_name() == "sqlite" and url.host:
        return "an SQLite file is named after three slashes, as in sqlite:///menshin.sqlite or sqlite:////srv/menshin.sqlite"
    return None


def problem(error: SQLAlchemyError) -> str | None:
    """The problem that an error of SQLAlchemy reports; None if the error is a bug."""
    if isinstance(error, ArgumentError):
        return f"database_url is not the address of a database; {ALLOWED}"
    if isinstance(error, PoolTimeoutError):
        return f"{_name(error)} is busy; try again later"
    if not isinstance(error, DBAPIError) or isinstance(error, IntegrityError | DataError):
        return None
    if reason := undone(error):
        return f"{_name(error)} undid this transaction, because {reason}; try again"
    of_file = type(error.orig).__module__.startswith("sqlite3")
    if of_file and _is_on_read_only_file_system(error):
        return f"{_name(error)} is on a read-only file system; {WRITABLE}"
    for part, (sentence, helps) in ((OF_SQLITE if of_file else OF_POSTGRESQL) | OF_BOTH).items():
        if part in _driver_message(error).lower():
            return f"{_name(error)} {sentence}; {helps}"
    if isinstance(error, OperationalError) and not of_file:
        return f"{_name(error)} cannot be used: {_driver_message(error)}"
    return None


def is_away(error: SQLAlchemyError) -> bool:
    """True if waiting may help, because the server does not answer or is busy; other problems need a person."""
    if isinstance(error, PoolTimeoutError):
        return True
    return isinstance(error, DBAPIError) and any(part in _driver_message(error).lower() for part in PASSING)


def undone(error: SQLAlchemyError) -> str | None:
    """The reason why the database undid a transaction, which can be repeated at once; None for any other error."""
    return UNDONE.get(getattr(error.orig, "sqlstate", None) or "") if isinstance(error, DBAPIError) else None


def _driver_message(error: DBAPIError) -> str:
    return " ".join(str(error.orig).split())


def name(error: BaseException, url: URL) -> None:
    """Add a note that names the database to an error."""
    error.add_note(f"{NOTE}{shown(url)}")


def shown(url: URL) -> str:
    """A database for display: the file, or the server and the name."""
    if url.get_backend_name() == "sqlite":
        return f"{THE_DATABASE}{url.database or 'in memory'}"
    port = "" if url.port is None else f":{url.port}"
    return f"the database {url.database or ''} at {url.host or 'this machine'}{port}"


def _is_on_read_only_file_system(error: DBAPIError) -> bool:
    """True if SQLite could not write to the database that a note names because nothing can be written there."""
    folder = Path(_name(error).removeprefix(THE_DATABASE)).parent
    refused = any(part in _driver_message(error).lower() for part in ("unable to open", "readonly database"))
    try:
        return refused and bool(os.statvfs(folder).f_flag & os.ST_RDONLY)
    except OSError:  # there is no such folder
        return False


def _name(error: BaseException) -> str:
    notes = getattr(error, "__notes__", [])
    return next((note.removeprefix(NOTE) for note in notes if note.startswith(NOTE)), "the database")


LONGEST_PAUSE = 30.0
"""s, longest pause between two attempts."""
MOST_DOUBLINGS = 30
"""Doublings of a pause after which it no longer grows, so that the number stays finite."""


@dataclass(slots=True)
class Attempts:
    """Repeated attempts at a database that may be unavailable for a while."""

    log: Logger
    failed: int = 0
    """Number of consecutive attempts at which the database did not answer."""

    @contextmanager
    def one(self) -> Iterator[None]:
        """One attempt, which ends early if the database does not answer or undoes it; other errors are raised."""
        try:
            yield
        except OperationalError as error:
            if reason := undone(error):
                self._note_answer()
                self.log.warning(
                    "the database undid a transaction, because %s; it is repeated (%s)", reason, _driver_message(error)
                )
                return
            if not self.failed:
                self.log.warning("the database cannot be used, trying again: %s", problem(error) or error.orig)
            self.failed += 1
        else:
            self._note_answer()

    def _note_answer(self) -> None:
        if self.failed:
            self.log.warning("the database is back")
        self.failed = 0

    def pause(self, usual: float) -> float:
        """s until the next attempt: `usual` while the database answers, doubled after each consecutive failure."""
        return min(usual * 2.0 ** min(self.failed, MOST_DOUBLINGS), LONGEST_PAUSE)
