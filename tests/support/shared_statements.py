"""Compiled SQL statements that all engines of a process share.

Each test has a database and with it an engine of its own, for which SQLAlchemy would compile every statement anew: two
thirds of the time of a test that reads a page.
"""

from typing import Any

from sqlalchemy import Connection, Engine, event
from sqlalchemy.util import LRUCache

MOST = 5000
"""Statements that are kept."""


class _Shared(LRUCache[Any, Any]):
    """Compiled statements by dialect and version of the server instead of by the dialect of one engine."""

    def get(self, key: Any, default: Any = None) -> Any:  # noqa: ANN401  SQLAlchemy's own types
        return super().get(_of_any_engine(key), default)

    def __getitem__(self, key: Any) -> Any:  # noqa: ANN401
        return super().__getitem__(_of_any_engine(key))

    def __setitem__(self, key: Any, value: Any) -> None:  # noqa: ANN401
        super().__setitem__(_of_any_engine(key), value)


def _of_any_engine(key: tuple[Any, ...]) -> tuple[Any, ...]:
    dialect, *rest = key
    return (type(dialect), getattr(dialect, "server_version_info", None), *rest)


def share() -> None:
    """Let all engines that are made in this process share their statements."""
    statements = _Shared(MOST)

    @event.listens_for(Engine, "engine_connect")
    def connected(connection: Connection) -> None:
        connection.execution_options(compiled_cache=statements)
