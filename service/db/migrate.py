"""Migrations of the database to the tables of this version."""

from collections.abc import Callable
from functools import cache
from typing import Any

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, event, inspect, text
from sqlalchemy.orm import Session

from service.db.problems import DatabaseVersionError, shown
from service.db.sessions import engine
from service.version import VERSION

LOCK = 6_334_607  # any number, the same in all processes of the service
FIRST = 20
"""Number of the first revision; lower numbers belong to development versions before the first release."""


def upgrade(url: str, revision: str = "head") -> None:
    """Upgrade the database to a revision; processes that start together take turns.

    Raises:
        DatabaseVersionError: the database belongs to a newer version of Menshin, to one before the first release, or
            to another program.
    """
    _run(url, lambda config: command.upgrade(config, revision))


def downgrade(url: str, revision: str) -> None:
    """Downgrade the database to a revision; `base` is the empty database."""
    _run(url, lambda config: command.downgrade(config, revision))


def is_newest(session: Session) -> bool:
    """True if the database has the tables of this version."""
    return MigrationContext.configure(session.connection()).get_current_revision() == newest()


@cache
def newest() -> str:
    """The revision of this version."""
    return str(ScriptDirectory.from_config(_config()).get_current_head())


def known_revisions() -> set[str]:
    """The revisions that this version can upgrade from, and its own."""
    return {script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions()}


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", "migrations:")
    return config


def _run(url: str, migrate: Callable[[Config], None]) -> None:
    config = _config()
    connected = engine(url)
    if connected.dialect.name == "sqlite":
        event.listen(connected, "connect", _let_tables_be_rebuilt)
    try:
        with connected.begin() as connection:
            if connection.dialect.name == "postgresql":
                connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": LOCK})
            _check(connection)
            config.attributes["connection"] = connection
            migrate(config)
    finally:
        connected.dispose()


def _check(connection: Connection) -> None:
    """Refuse a database of another version or program, or one that cannot be written."""
    name = shown(connection.engine.url)
    known = known_revisions()
    current = MigrationContext.configure(connection).get_current_heads()
    unknown = set(current) - known
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
    if current:  # nothing else is written until much later, by a part that would treat the error as temporary
        connection.execute(text("UPDATE alembic_version SET version_num = version_num"))


def _let_tables_be_rebuilt(connection: Any, _: object) -> None:  # noqa: ANN401  the driver's own connection
    """Switch foreign keys off: SQLite alters a table by rebuilding it, which would delete referencing rows."""
    connection.execute("PRAGMA foreign_keys=OFF")
