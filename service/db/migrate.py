"""Migrations of the database to the tables of this version."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from sqlalchemy import Connection, event, inspect, text
from sqlalchemy.orm import Session

from service.db.problems import DatabaseVersionError, shown
from service.db.sessions import engine
from service.version import VERSION

if TYPE_CHECKING:
    from alembic.config import Config

LOCK = 6_334_607  # any number, the same in all processes of the service
FIRST = 20
"""Number of the first revision; lower numbers belong to development versions before the first release."""


def upgrade(url: str, revision: str = "head") -> None:
    """Upgrade the database to a revision; processes that start together take turns.

    Raises:
        DatabaseVersionError: the database belongs to a newer version of Menshin, to one before the first release, or
            to another program.
    """
    with _connected(url) as connection:
        if revision == "head" and _current(connection) == {newest()}:
            _write(connection)
            return
        from alembic import command  # most starts find nothing to upgrade, and need no Alembic

        command.upgrade(_checked(connection), revision)


def downgrade(url: str, revision: str) -> None:
    """Downgrade the database to a revision; `base` is the empty database."""
    from alembic import command

    with _connected(url) as connection:
        command.downgrade(_checked(connection), revision)


def is_newest(session: Session) -> bool:
    """True if the database has the tables of this version."""
    return _current(session.connection()) == {newest()}


def newest() -> str:
    """The revision of this version."""
    return max(known_revisions())


@cache
def known_revisions() -> frozenset[str]:
    """The revisions that this version can upgrade from, and its own; each is the name of its file."""
    names = (file.name for file in (files("migrations") / "versions").iterdir())
    return frozenset(name.removesuffix(".py") for name in names if name[:4].isdigit() and name.endswith(".py"))


def _current(connection: Connection) -> set[str]:
    """Revisions of a database; none if it has never been migrated."""
    if not inspect(connection).has_table("alembic_version"):
        return set()
    return set(connection.scalars(text("SELECT version_num FROM alembic_version")))


@contextmanager
def _connected(url: str) -> Iterator[Connection]:
    """A transaction on a database that no other process migrates meanwhile."""
    connected = engine(url)
    if connected.dialect.name == "sqlite":
        event.listen(connected, "connect", _let_tables_be_rebuilt)
    try:
        with connected.begin() as connection:
            if connection.dialect.name == "postgresql":
                connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": LOCK})
            yield connection
    finally:
        connected.dispose()


def _checked(connection: Connection) -> "Config":
    """Configuration of Alembic for a database that was checked."""
    from alembic.config import Config

    _check(connection)
    config = Config()
    config.set_main_option("script_location", "migrations:")
    config.attributes["connection"] = connection
    return config


def _check(connection: Connection) -> None:
    """Refuse a database of another version or program, or one that cannot be written."""
    name = shown(connection.engine.url)
    current = _current(connection)
    unknown = current - known_revisions()
    if early := sorted(revision for revision in unknown if revision[:4].isdigit() and int(revision[:4]) < FIRST):
        raise DatabaseVersionError(
            f"{name} belongs to a development version before the first release (revision {early[0]}), which Menshin "
            f"{VERSION} cannot upgrade; move it away or name another database, and add the buildings again"
        )
    if unknown:
        raise DatabaseVersionError(
            f"{name} belongs to another version of Menshin: {VERSION} does not know its revision "
            f"{', '.join(sorted(unknown))}; run that version, or name another database"
        )
    if not current and (tables := set(inspect(connection).get_table_names()) - {"alembic_version"}):
        raise DatabaseVersionError(
            f"{name} has tables of another program ({', '.join(sorted(tables)[:3])}); name another database"
        )
    if current:
        _write(connection)


def _write(connection: Connection) -> None:
    """Write to the database: nothing else does until much later, in a part that would treat the error as temporary."""
    connection.execute(text("UPDATE alembic_version SET version_num = version_num"))


def _let_tables_be_rebuilt(connection: Any, _: object) -> None:  # noqa: ANN401  the driver's own connection
    """Switch foreign keys off: SQLite alters a table by rebuilding it, which would delete referencing rows."""
    connection.execute("PRAGMA foreign_keys=OFF")
