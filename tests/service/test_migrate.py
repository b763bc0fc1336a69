"""Up, down, and in step with the tables, on a database with rows."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime

import histories
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import MetaData, inspect
from sqlalchemy.orm import Session, sessionmaker

from service import migrate
from service.database import Alert, Base, Building, Inspection, ReferencePeriod, Revision, WatchedSeries
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


def test_alerts_of_one_layer_become_one_and_none_is_lost(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        of = histories.building(session).id
    sessions.kw["bind"].dispose()
    migrate.downgrade(database_url, "0014_alert_words")
    connected = engine(database_url)
    tables = MetaData()
    tables.reflect(connected)
    seen = {"drift": -0.08, "low": -0.09, "high": -0.07, "rule": "sudden"}
    with connected.begin() as connection:
        for number, (cause, state, held_by, is_open) in enumerate(
            (
                ("stiffness/x", "resolved", None, False),
                ("stiffness/xy", "on_hold", "stiffness/y", True),
                ("stiffness/x", "acknowledged", None, True),
                ("stiffness/y", "active", None, True),
                ("damping/xy", "on_hold", "damping/x", True),
                ("frequency/x/1", "active", None, True),
            ),
            start=1,
        ):
            alert = {"id": number, "building_id": of, "cause": cause, "kind": "deterioration", "state": state}
            alert |= {"held_by": held_by, "began_at": NOW, "opened_at": NOW, "updated_at": NOW, "evidence": seen}
            alert |= {"event_ids": [], "channels": [], "sentences": [], "summary": cause}
            connection.execute(tables.tables["alert"].insert().values(**alert, closed_at=None if is_open else NOW))
        inspection = {"alert_id": 1, "at": NOW, "by": "Jo", "outcome": "confirmed", "note": "n", "evidence": seen}
        connection.execute(tables.tables["inspection"].insert().values(**inspection))
    connected.dispose()
    migrate.upgrade(database_url)
    with sessions() as session:
        every = {one.id: one for one in session.query(Alert)}
        found = {number: (one.cause, one.state, one.closed_at is None) for number, one in every.items()}
        parts = {number: [one["subject"] for one in every[number].evidence["parts"]] for number in (1, 4, 5)}
        note = every[3].changes[-1].note
        (looked,) = session.query(Inspection)
        assert [(one["subject"], one["drift"]) for one in looked.evidence["parts"]] == [("x", -0.08)]
    assert found == {
        1: ("stiffness", "resolved", False),
        2: ("stiffness", "resolved", False),
        3: ("stiffness", "resolved", False),
        4: ("stiffness", "active", True),
        5: ("damping", "active", True),  # what held it back was its like, and no longer is there
        6: ("frequency/x/1", "active", True),
    }
    assert parts == {1: ["x"], 4: ["xy", "x", "y"], 5: ["xy"]}
    assert note.startswith("It is a part of alert 4 from now on")
    sessions.kw["bind"].dispose()
    migrate.downgrade(database_url, "0014_alert_words")
    migrate.upgrade(database_url)
    with sessions() as session:
        assert {one.id: one.cause for one in session.query(Alert)} == {number: one[0] for number, one in found.items()}


def test_two_processes_may_start_together(empty_database_url: str) -> None:
    with ThreadPoolExecutor(2) as pool:
        for started in [pool.submit(migrate.upgrade, empty_database_url) for _ in range(2)]:
            started.result()
    assert tables(empty_database_url) == set(Base.metadata.tables)
