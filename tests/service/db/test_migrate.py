"""Up, down, and in step with the tables, on a database with rows."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime

import pytest
from alembic.autogenerate import compare_metadata
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, text
from sqlalchemy.orm import Session, sessionmaker

from service.buildings.tables import Building, Revision
from service.db import migrate
from service.db.base import Base
from service.db.problems import DatabaseVersionError
from service.db.sessions import engine

NOW = datetime(2024, 1, 1, tzinfo=UTC)


def with_rows(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        building = Building(code="B", name="tower", created_at=NOW)
        session.add(Revision(building=building, number=1, toml="", folder="/", created_at=NOW))


def tables(url: str) -> set[str]:
    connected = engine(url)
    try:
        return set(inspect(connected).get_table_names()) - {"alembic_version"}
    finally:
        connected.dispose()


def test_migrations_and_tables_are_in_step(sessions: sessionmaker[Session]) -> None:
    with sessions.kw["bind"].connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_server_default": True})
        assert compare_metadata(context, Base.metadata) == []


def test_a_revision_is_the_name_of_its_file() -> None:
    """A start without anything to upgrade reads names alone; Alembic reads the files."""
    config = Config()
    config.set_main_option("script_location", "migrations:")
    scripts = ScriptDirectory.from_config(config)
    assert migrate.known_revisions() == {script.revision for script in scripts.walk_revisions()}
    assert migrate.newest() == scripts.get_current_head()


def test_up_again_changes_nothing(database_url: str, sessions: sessionmaker[Session]) -> None:
    with_rows(sessions)
    migrate.upgrade(database_url)
    with sessions() as session:
        assert session.query(Revision).one().created_at == NOW


def test_down_and_up_again_with_rows(database_url: str, sessions: sessionmaker[Session]) -> None:
    with_rows(sessions)
    sessions.kw["bind"].dispose()
    migrate.downgrade(database_url, "base")
    assert tables(database_url) == set()
    with sessions() as session:
        assert not migrate.is_newest(session)
    migrate.upgrade(database_url)
    with sessions() as session:
        assert migrate.is_newest(session)
    assert tables(database_url) == set(Base.metadata.tables)
    with_rows(sessions)


@pytest.mark.parametrize("revision", ["0001", "0019_looked_at"])
def test_a_database_from_before_the_first_release_is_refused_in_words(database_url: str, revision: str) -> None:
    connected = engine(database_url)
    with connected.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = :revision"), {"revision": revision})
    connected.dispose()
    with pytest.raises(DatabaseVersionError, match=rf"before the first release \(revision {revision}\)") as refused:
        migrate.upgrade(database_url)
    assert "move it away or name another database" in str(refused.value)


def test_two_processes_may_start_together(empty_database_url: str) -> None:
    with ThreadPoolExecutor(2) as pool:
        for started in [pool.submit(migrate.upgrade, empty_database_url) for _ in range(2)]:
            started.result()
    assert tables(empty_database_url) == set(Base.metadata.tables)
