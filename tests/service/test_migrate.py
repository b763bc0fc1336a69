"""Up, down, and in step with the tables, on a database with rows."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime

import histories
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import inspect
from sqlalchemy.orm import Session, sessionmaker

from service import migrate
from service.database import Base, Building, ReferencePeriod, Revision, WatchedSeries
from service.queue import jobs
from service.sessions import engine

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


def test_a_period_for_one_sensor_does_not_become_one_for_all(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        of = histories.building(session).id
        job = jobs.enqueue_watch(session, of, None, NOW)
        for subject in (None, "XX.B.01.HNX"):
            period = ReferencePeriod(
                building_id=of, quantity="gain", subject=subject, author="Kimura", reason="swapped", created_at=NOW
            )
            series = WatchedSeries(
                building_id=of,
                job_id=job.id,
                created_at=NOW,
                version="test",
                quantity="gain",
                subject=subject or "another",
                wanted=0,
                reference=period,
            )
            session.add(series)
    sessions.kw["bind"].dispose()
    migrate.downgrade(database_url, "0011_server_clock")
    migrate.upgrade(database_url)
    with sessions() as session:
        assert [one.subject for one in session.query(ReferencePeriod)] == [None]
        assert {one.subject: one.reference_id for one in session.query(WatchedSeries)}["XX.B.01.HNX"] is None


def test_two_processes_may_start_together(empty_database_url: str) -> None:
    with ThreadPoolExecutor(2) as pool:
        for started in [pool.submit(migrate.upgrade, empty_database_url) for _ in range(2)]:
            started.result()
    assert tables(empty_database_url) == set(Base.metadata.tables)
