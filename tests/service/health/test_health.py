"""Readiness and Prometheus metrics of the service."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from api_client import client
from assessed_buildings import building_file
from prometheus_client.parser import text_string_to_metric_families
from sqlalchemy import text
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auth import Role
from service.analyses.tables import Analysis
from service.buildings.tables import Building, Revision
from service.db import process_leases
from service.db.process_leases import NOTIFYING, POLLING, WORKING
from service.health import metrics
from service.jobs.tables import Job, Lease
from service.records.tables import Event, Recording, SourceState, StreamState

START = datetime(2011, 3, 11, 5, 46, 24, tzinfo=UTC)
END = START + timedelta(minutes=3)


def alive(sessions: sessionmaker[Session], seconds: float) -> None:
    """Poller and worker have their leases until so many seconds from now."""
    now = datetime.now(UTC)
    with sessions.begin() as session:
        for right in (POLLING, WORKING):
            process_leases.hold(session, right, "host:1", now, timedelta(seconds=seconds))


def test_ready_means_this_versions_tables_a_poller_and_a_worker(
    database_url: str, sessions: sessionmaker[Session]
) -> None:
    with client(database_url, disk_reserve=0) as api:
        assert "no poller was seen lately; no worker was seen lately" in api.get("/readyz").json()["detail"]
        alive(sessions, 60)
        assert api.get("/readyz").json()["status"] == "ready"
        alive(sessions, -1)
        assert api.get("/readyz").status_code == 503
        alive(sessions, 60)
        with sessions.begin() as session:
            session.execute(text("UPDATE alembic_version SET version_num = 'other'"))
        answer = api.get("/readyz")
    assert answer.status_code == 503
    assert "tables" in answer.json()["detail"]


def test_without_tables_the_service_lives_but_is_not_ready(empty_database_url: str) -> None:
    with client(empty_database_url) as api:
        assert api.get("/healthz").json() == {"status": "alive"}
        assert "tables" in api.get("/readyz").json()["detail"]


def test_a_database_that_cannot_be_reached_is_reported(tmp_path: Path) -> None:
    (tmp_path / "folder.sqlite").mkdir()
    with client(f"sqlite:///{tmp_path / 'folder.sqlite'}") as api:
        answer = api.get("/readyz")
    assert answer.status_code == 503
    assert answer.json()["detail"] == "Not ready: the database does not answer."


def filled(session: Session) -> None:
    """Two buildings; at the first two events, one analysed twice and one that waits."""
    first, second = (Building(code=code, name=code, created_at=START) for code in ("A", "B"))
    revision, other = (
        Revision(building=one, number=1, toml=building_file(one.code), folder="/", created_at=START)
        for one in (first, second)
    )
    made = {"created_at": START, "updated_at": START}
    done, waiting = (Event(building=first, start=START, end=END, state=s, **made) for s in ("refused", "queued"))
    session.add_all([first, second, revision, other, done, waiting])
    session.flush()
    jobs = [
        Job(kind="analyse", event_id=event.id, arguments={}, state=state, created_at=START + timedelta(days=day))
        for day, (event, state) in enumerate([(done, "done"), (done, "done"), (waiting, "waiting"), (done, "waiting")])
    ]
    session.add_all(jobs)
    session.flush()
    common = {"revision_id": revision.id, "created_at": START, "version": "1", "settings": {}, "inputs": []}
    for job, refusal in zip(jobs[:2], (None, "no ground"), strict=True):
        session.add(
            Analysis(event=done, job_id=job.id, current=bool(refusal), quality=[], peaks={}, refusal=refusal, **common)
        )
    received = {"origin": "/", "received_at": START, "kind": "waveforms"}
    for name, state, end in (("1", "read", END), ("2", "read", END - timedelta(days=1)), ("3", "refused", None)):
        session.add(Recording(building_id=first.id, name=name, state=state, end=end, **received))
    session.add(SourceState(building_id=first.id, cursor={}, failing_since=END))
    session.add(SourceState(building_id=second.id, cursor={}))
    flows = {
        name: {"reached": END.isoformat(), "latency": latency, "gaps": gaps, "missing": missing}
        for name, latency, gaps, missing in (("1", 2.5, 0, 0.0), ("2", 4.0, 3, 7.5))
    }
    counts = {"packets": 9, "doubles": 2, "refused": 1, "looked": 0}
    session.add(StreamState(building_id=second.id, received_at=END, channels=flows, shaking=[], cuts=[], **counts))


def reported(answer: str) -> dict[tuple[str, ...], float]:
    """Values by name and labels."""
    return {
        (sample.name, *sample.labels.values()): sample.value
        for family in text_string_to_metric_families(answer)
        for sample in family.samples
    }


def test_metrics_show_what_the_database_holds(database_url: str, sessions: sessionmaker[Session]) -> None:
    until = datetime(2030, 1, 1, tzinfo=UTC)
    with sessions.begin() as session:
        filled(session)
        session.add_all([Lease(name=name, holder="host:1", until=until) for name in (NOTIFYING, "poller/host:1")])
    with client(database_url) as api:
        found = reported(api.get("/metrics").text)
    state = {name: value for name, value in found.items() if not name[0].startswith("menshin_http")}
    assert state == {
        ("menshin_process_lease_timestamp_seconds", "notifier"): until.timestamp(),
        ("menshin_events", "queued"): 1,
        ("menshin_events", "refused"): 1,
        ("menshin_jobs", "done"): 2,
        ("menshin_jobs", "waiting"): 2,
        ("menshin_oldest_waiting_job_timestamp_seconds",): (START + timedelta(days=2)).timestamp(),
        ("menshin_last_good_record_timestamp_seconds", "A"): END.timestamp(),
        ("menshin_source_failing_since_timestamp_seconds", "A"): END.timestamp(),
        ("menshin_stream_last_packet_timestamp_seconds", "B"): END.timestamp(),
        ("menshin_stream_gaps", "B"): 3,
        ("menshin_stream_missing_seconds", "B"): 7.5,
        ("menshin_stream_packets_refused", "B"): 1,
        ("menshin_verdict", "A"): 2,
        ("menshin_verdict", "B"): 3,
        ("menshin_open_alerts", "A"): 0,
        ("menshin_open_alerts", "B"): 0,
        ("menshin_recordings_refused", "A"): 1,
        ("menshin_recordings_refused", "B"): 0,
        ("menshin_analyses", "refused"): 1,
        ("menshin_analyses", "result"): 1,
        ("menshin_failed_deliveries", "A"): 0,
        ("menshin_failed_deliveries", "B"): 0,
    }


def test_requests_are_counted_by_route_and_status(database_url: str) -> None:
    with client(database_url) as api:
        for path in ("/healthz", "/healthz", "/api/v1/buildings/X", "/api/v1/buildings/Y", "/no/such", "/nor/such"):
            api.get(path)
        found = reported(api.get("/metrics").text)
    counts = {name[1:]: value for name, value in found.items() if name[0].endswith("seconds_count")}
    assert counts == {("/healthz", "200"): 2, ("/api/v1/buildings/{code}", "404"): 2, ("other", "404"): 2}


def test_metrics_take_a_key_where_there_are_keys(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        key = keys.create(session, "prometheus", Role.viewer, START)
    with client(database_url) as api:
        assert api.get("/metrics").status_code == 401
        assert api.get("/metrics", headers={"Authorization": f"Bearer {key}"}).status_code == 200


def test_a_label_is_written_so_that_a_parser_reads_it_back(
    monkeypatch: pytest.MonkeyPatch, sessions: sessionmaker[Session]
) -> None:
    name = 'a "quoted" \\ back\nslash'
    monkeypatch.setitem(metrics.GAUGES, "menshin_trial", ("Meaning.", "building", lambda _: {name: 1e21, "b": 0.25}))
    (family,) = (
        one
        for one in text_string_to_metric_families(metrics.exposition(sessions).decode())
        if one.name == "menshin_trial"
    )
    assert {one.labels["building"]: one.value for one in family.samples} == {name: 1e21, "b": 0.25}
