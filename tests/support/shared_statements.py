"""Compiled SQL statements that all engines of a process share.

Each test has a database and with it an engine of its own, for which SQLAlchemy would compile every statement anew: two
thirds of the time of a test that reads a page.
"""

from typing import Any

from sqlalchemy import Connection, Dialect, Engine, event
from sqlalchemy.util import LRUCache

MOST = 5000
"""Statements that are kept."""
Key = tuple[Any, ...]
"""SQLAlchemy's: the dialect of an engine, and what determines a statement's text."""


class _Shared(LRUCache[Key, object]):
    """Compiled statements by the kind of a dialect instead of by the dialect of one engine."""

    def get(self, key: Key, default: object = None) -> object:
        return super().get(_of_any_engine(key), default)

    def __getitem__(self, key: Key) -> object:
        return super().__getitem__(_of_any_engine(key))

    def __setitem__(self, key: Key, value: object) -> None:
        super().__setitem__(_of_any_engine(key), value)


def _of_any_engine(key: Key) -> Key:
    dialect, *rest = key
    assert isinstance(dialect, Dialect)
    return (type(dialect), dialect.server_version_info, *rest)


def share() -> None:
    """Let all engines that are made in this process share their statements."""
    statements = _Shared(MOST)

    @event.listens_for(Engine, "engine_connect")
    def connected(connection: Connection) -> None:
        connection.execution_options(compiled_cache=statements)
