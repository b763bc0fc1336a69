"""How a database gets the tables that this version of the code expects."""

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

LOCK = 6_334_607  # any number, the same in all our processes
FIRST = 20
"""Number of the first revision. Lower ones belong to development versions from before the first release."""


def upgrade(url: str, revision: str = "head") -> None:
    """Bring the database up to a revision; two processes that start together do it one after the other.

    Raises:
        DatabaseVersionError: it is of a newer version of menshin, of one from before the first release, or of another
            program.
    """
    _run(url, lambda config: command.upgrade(config, revision))


def downgrade(url: str, revision: str) -> None:
    """Bring the database down to a revision; `base` is the empty database."""
    _run(url, lambda config: command.downgrade(config, revision))


def is_newest(session: Session) -> bool:
    """Whether a database has the tables that this version of the code expects."""
    return MigrationContext.configure(session.connection()).get_current_revision() == _newest()


@cache
def _newest() -> str | None:
    return ScriptDirectory.from_config(_config()).get_current_head()


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
    """Refuse a database of another version or another program, and one that cannot be written."""
    name = shown(connection.engine.url)
    known = {script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions()}
    current = MigrationContext.configure(connection).get_current_heads()
    strange = set(current) - known
    if early := sorted(revision for revision in strange if revision[:4].isdigit() and int(revision[:4]) < FIRST):
        raise DatabaseVersionError(
            f"{name} is of a development version from before the first release (revision {early[0]}), which menshin "
            f"{VERSION} cannot upgrade; move it away or name another database, and add the buildings again"
        )
    if strange:
        raise DatabaseVersionError(
            f"{name} is of another version of menshin than this one ({VERSION}), which does not know its revision "
            f"{', '.join(sorted(strange))}; run that version, or name another database"
        )
    if not current and (tables := set(inspect(connection).get_table_names()) - {"alembic_version"}):
        raise DatabaseVersionError(
            f"{name} has tables that menshin did not make ({', '.join(sorted(tables)[:3])}); name another database"
        )
    if current:  # nothing else may be written until much later, and then by a part that takes it for a passing fault
        connection.execute(text("UPDATE alembic_version SET version_num = version_num"))


def _let_tables_be_rebuilt(connection: Any, _: object) -> None:  # noqa: ANN401  the driver's own connection
    """SQLite alters a table by making it anew, which foreign keys would take for the loss of every row."""
    connection.execute("PRAGMA foreign_keys=OFF")
