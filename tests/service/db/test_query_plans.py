"""Frequent queries use an index on both kinds of database, so that nothing grows with the whole history."""

import re
from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta

import pytest
from assessed_buildings import add_comparison, building, day, earthquake
from sqlalchemy import Connection, event, text
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import building_states
from service.analyses import queries as analysis_queries
from service.buildings.tables import Building
from service.health.metrics import GAUGES
from service.jobs import queue as job_queue
from service.models import queries as model_queries
from service.records import events
from service.records.ingest import next_stored
from service.records.polled_together import polled
from service.retention.pruning import prunable
from service.settings import Settings
from service.verdict import reading

NOW = datetime(2024, 1, 5, tzinfo=UTC)
LEASE = timedelta(minutes=2)
BUILDING = Building(id=1, code="B", name="tower", created_at=NOW)
READS: dict[str, tuple[Callable[[Session], object], Sequence[str]]] = {
    "events that wait, every five seconds": (
        lambda session: events.is_any_ready(session, NOW, settings=Settings()),
        ["ix_event_state_updated_at"],
    ),
    "events to queue": (
        lambda session: events.queue_ready(session, NOW, settings=Settings()),
        ["ix_event_state_updated_at"],
    ),
    "recordings to be read": (lambda session: next_stored(session, BUILDING), ["ix_recording_stored"]),
    "the poll of a source": (
        lambda session: session.execute(polled(), {"codes": ["B"], "past": NOW}),
        ["ix_recording_stored"],
    ),
    "recordings to read again": (
        lambda session: session.execute(polled(), {"codes": ["B"], "past": NOW}),
        ["ix_recording_refused"],
    ),
    "neglected jobs": (lambda session: job_queue.neglected_since(session, NOW, LEASE), ["ix_job_state_id"]),
    "last progress": (
        lambda session: job_queue.last_progress(session, NOW, LEASE),
        ["ix_job_finished_at", "ix_job_state_id"],
    ),
    "results of an analysis": (lambda session: analysis_queries.direction_results(session, 1), ["direction_result"]),
    "its results across directions": (lambda session: analysis_queries.layer_result(session, 1), ["layer_result"]),
    "comparisons of models": (lambda session: model_queries.latest_comparisons(session, [1, 2]), ["model_comparison"]),
    "an event that models in force are compared with": (
        lambda session: model_queries.comparable(session, 1, ("x",), [1]),
        ["direction_result"],
    ),
    "models in force": (lambda session: model_queries.current_versions(session, 1), ["model_version"]),
}
"""A query, and an index that each of its statements uses."""
ROUND = ("ix_event_building_id_updated_at", "ix_recording_read", "ix_recording_refused", "ix_alert_building_id")
"""Indexes that a round of the periodic checks uses."""


@pytest.mark.parametrize("name", READS)
def test_a_statement_takes_its_index(sessions: sessionmaker[Session], name: str) -> None:
    read, indexes = READS[name]
    found = plans(sessions, read)
    assert len(found) == len(indexes)
    for plan, index in zip(found, indexes, strict=True):
        assert index in plan, plan
        assert "SCAN" not in plan.replace("SCAN CONSTANT", ""), plan
        assert "Seq Scan" not in plan, plan


def test_a_round_of_checks_reads_no_history(sessions: sessionmaker[Session]) -> None:
    """Neither for all buildings nor for one are tables that grow with every earthquake read."""
    for building_id in (None, 1):
        found = plans(sessions, lambda session: building_states.read(session, LEASE, NOW, building_id))  # noqa: B023
        whole = "\n".join(found)
        assert all(index in whole for index in ROUND)
        for plan in found:
            assert not re.search(r"Seq Scan on (event|recording|job|alert|alert_change)\b", plan), plan
            scanned = re.findall(r"SCAN (?:event|recording|job|alert|alert_change)\b.*", plan)
            assert all("INDEX ix_recording_refused" in one for one in scanned), plan


def test_the_verdicts_of_some_buildings_read_no_history(sessions: sessionmaker[Session]) -> None:
    """Neither of other buildings nor of other analyses."""
    with sessions.begin() as session:
        made = building(session)
        add_comparison(session, earthquake(session, made, day(1), 0.1))
        number = made.id
    found = plans(sessions, lambda session: reading.standings(session, [number]))
    assert len(found) > 10
    tables = "analysis|direction_result|layer_result|shaking_result|event|drift_value|watched_series|alert"
    for plan in found:
        assert not re.search(rf"Seq Scan on ({tables})\b", plan), plan
        assert not re.search(rf"SCAN ({tables})\b", plan), plan


def test_the_recordings_of_an_original_file_are_found_by_its_digest(sessions: sessionmaker[Session]) -> None:
    """Pruning looks for them once for each file; PostgreSQL may read all of them, but only once."""
    settings = Settings(retention={"original_files": 30 * 86_400.0})
    found = [plan for plan in plans(sessions, lambda session: prunable(session, settings, NOW)) if "recording" in plan]
    assert found
    for plan in found:
        assert "ix_recording_sha256" in plan, plan
        assert "SCAN recording" not in plan, plan


def plans(sessions: sessionmaker[Session], read: Callable[[Session], object]) -> list[str]:
    """The plan of each statement that reads; without statistics an empty table would be read in full."""
    executed: list[tuple[str, object]] = []

    def note(_1: object, _2: object, statement: str, parameters: object, *_3: object) -> None:
        if re.match("SELECT|WITH", statement):
            executed.append((statement, parameters))

    with sessions() as session:
        connection = session.connection()
        if connection.dialect.name == "postgresql":
            session.execute(text("SET LOCAL enable_seqscan = off"))
        event.listen(connection, "before_cursor_execute", note)
        read(session)
        event.remove(connection, "before_cursor_execute", note)
        return [_plan(connection, *one) for one in executed]


def _plan(connection: Connection, statement: str, parameters: object) -> str:
    prefix = "EXPLAIN QUERY PLAN " if connection.dialect.name == "sqlite" else "EXPLAIN "
    rows = connection.exec_driver_sql(prefix + statement, parameters)  # type: ignore[arg-type]
    return "\n".join(str(row[-1]) for row in rows)


def test_metrics_count_the_history_in_indexes_alone(sessions: sessionmaker[Session]) -> None:
    """Tables that grow with every earthquake."""
    for name, (_, _, read) in GAUGES.items():
        for plan in plans(sessions, read):
            assert not re.search(r"Seq Scan on (event|recording|waveform|job|analysis|delivery)\b", plan), (
                f"{name}: {plan}"
            )
            scanned = re.findall(r"SCAN (?:event|recording|waveform|job|analysis|delivery)\b.*", plan)
            assert all("INDEX" in one for one in scanned), f"{name}: {plan}"
