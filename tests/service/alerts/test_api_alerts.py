"""Alerts, silences and the audit trail by the API."""

import csv
import io
from collections.abc import Iterator
from datetime import timedelta

import pytest
from alert_candidates import DAY, START, softer_isolators, stopped_data
from alert_fixtures import building, earthquake
from api_client import client
from fastapi.testclient import TestClient
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auth import Role
from service.access.tables import AuditEntry
from service.alerts.messages import write_messages
from service.alerts.reconciliation import reconcile
from service.alerts.tables import Alert
from service.buildings.tables import Building
from service.drift.tables import ReferencePeriod
from service.jobs.tables import Job
from service.notify.tables import Delivery, Message, Receiver

pytestmark = pytest.mark.sqlite

NOW = START + 10 * DAY
AGE = timedelta(days=10_000)
ALERTS = "/api/v1/alerts"


@pytest.fixture
def code(sessions: sessionmaker[Session]) -> str:
    """A building with a reported loss of stiffness, whose server does not answer."""
    with sessions.begin() as session:
        of = building(session)
        session.add(
            Receiver(
                building_id=of.id,
                name="office",
                kind="webhook",
                address="https://hooks.example/1",
                kinds=["alert"],
                severities=["alarm", "normal"],
                origin="api",
                created_at=NOW,
            )
        )
        event = earthquake(session, of, START)
        found = softer_isolators(onset_event_id=event.id, raised_event_id=event.id, event_ids=(event.id,))
        reconcile(session, of.id, [found], "events", NOW)
        reconcile(session, of.id, [stopped_data()], "clock", NOW)
        session.flush()
        write_messages(session, of.id, AGE, NOW)
        return of.code


@pytest.fixture
def api(database_url: str, code: str) -> Iterator[TestClient]:
    with client(database_url) as made:
        yield made


def test_alerts_are_listed_and_filtered(api: TestClient, code: str) -> None:
    every = api.get(ALERTS).json()["items"]
    assert [(one["cause"], one["state"]) for one in every] == [("source", "active"), ("stiffness", "active")]
    assert {one["building"] for one in every} == {code}
    for query, causes in (
        (f"building={code}&kind=data", ["source"]),
        ("state=open", ["source", "stiffness"]),
        ("state=resolved", []),
    ):
        assert [one["cause"] for one in api.get(f"{ALERTS}?{query}").json()["items"]] == causes
    assert api.get(f"{ALERTS}?building=NONE").status_code == 404
    page = api.get(f"{ALERTS}?limit=1").json()
    assert api.get(f"{ALERTS}?limit=1&cursor={page['next']}").json()["items"][0]["cause"] == "stiffness"
    lines = list(csv.DictReader(io.StringIO(api.get(f"{ALERTS}?format=csv").text)))
    assert [line["summary"] for line in lines] == [one["summary"] for one in every]


def test_an_alert_shows_its_evidence_history_and_recipients(api: TestClient) -> None:
    found = api.get(f"{ALERTS}/1").json()
    assert found["evidence"]["drift"] == -0.08
    assert [(one["state"], one["by"]) for one in found["changes"]] == [("active", None)]
    assert [(one["receiver"], one["state"], one["sequence"]) for one in found["messages"]] == [
        ("office", "waiting", "new")
    ]
    assert api.get(f"{ALERTS}/99").status_code == 404


def test_an_alert_is_acknowledged_and_ended_by_an_inspection(api: TestClient, sessions: sessionmaker[Session]) -> None:
    for _ in range(2):
        taken = api.post(f"{ALERTS}/1/acknowledge", json={"note": "on my way", "name": "Jo"})
        assert taken.status_code == 200, taken.text
    assert (taken.json()["state"], taken.json()["acknowledged_by"]) == ("acknowledged", "Jo (loopback)")
    wanted = {"outcome": "confirmed", "note": "two bearings were replaced", "reference_from": "2024-01-05"}
    for _ in range(2):
        ended = api.post(f"{ALERTS}/1/inspect", json=wanted)
        assert ended.status_code == 200, ended.text
    assert [one["state"] for one in ended.json()["changes"]] == ["active", "acknowledged", "resolved"]
    (inspection,) = ended.json()["inspections"]
    assert inspection["reference_from"] == "2024-01-05T00:00:00Z"
    with sessions.begin() as session:
        assert session.query(AuditEntry).count() == 2
        [period] = session.query(ReferencePeriod)
        assert (period.quantity, period.reason) == ("stiffness", "Inspection of alert 1: two bearings were replaced")
        (watching,) = session.query(Job).filter(Job.kind == "watch")
        assert session.query(Message).filter(Message.key.like("event/%")).count() == 1
        watching.state = "done"
        write_messages(session, watching.building_id, AGE, NOW)
        assert [message.sequence for message in session.query(Message).filter(Message.key.like("event/%"))] == [
            "new",
            "updated",
        ]
        assert session.query(Delivery).count() == 2
    late = api.post(f"{ALERTS}/1/inspect", json={"outcome": "unfounded", "note": "no"})
    assert late.status_code == 409
    assert "resolved since" in late.json()["detail"]


@pytest.mark.parametrize(
    "body",
    [{}, {"note": " "}, {"note": "x", "more": 1}, {"note": "x", "name": ""}, {"note": 3}],
)
def test_an_acknowledgement_needs_a_note(api: TestClient, body: dict[str, object]) -> None:
    assert api.post(f"{ALERTS}/1/acknowledge", json=body).status_code == 422


def test_a_silence_has_an_end_and_a_reason_and_can_be_ended(api: TestClient, code: str) -> None:
    silences = f"/api/v1/buildings/{code}/silences"
    wanted = {"pattern": "stiffness/*", "until": "2999-01-01T00:00:00Z", "reason": "a load test"}
    for _ in range(2):
        made = api.post(silences, json=wanted)
        assert made.status_code == 201, made.text
    assert api.get(f"{ALERTS}/1").json()["silenced_until"] == "2999-01-01T00:00:00Z"
    (listed,) = api.get(silences).json()["items"]
    assert listed == made.json()
    for _ in range(2):
        ended = api.post(f"/api/v1/silences/{listed['id']}/end")
        assert (ended.status_code, ended.json()["ended_by"]) == (200, "loopback")
    assert api.get(f"{ALERTS}/1").json()["silenced_until"] is None
    assert api.post(silences, json=wanted | {"until": "2020-01-01T00:00:00Z"}).status_code == 409
    assert api.post(silences, json={"pattern": "*", "until": "2999-01-01T00:00:00Z"}).status_code == 422
    assert api.get(f"{silences}?format=csv").text.count("\n") == 2
    assert api.post("/api/v1/silences/99/end").status_code == 404


def test_a_viewer_reads_and_does_no_more(database_url: str, sessions: sessionmaker[Session], code: str) -> None:
    with sessions.begin() as session:
        viewer, engineer = (keys.create(session, role.name, role, NOW) for role in (Role.viewer, Role.engineer))
    with client(database_url) as api:
        api.headers["X-API-Key"] = viewer
        for path in (ALERTS, f"{ALERTS}/1", f"/api/v1/buildings/{code}/silences"):
            assert api.get(path).status_code == 200
        assert api.get("/api/v1/audit").status_code == 403
        for path in (f"{ALERTS}/1/acknowledge", f"{ALERTS}/1/inspect", f"/api/v1/buildings/{code}/silences"):
            assert api.post(path, json={}).status_code == 403
        api.headers["X-API-Key"] = engineer
        assert api.post(f"{ALERTS}/1/acknowledge", json={"note": "mine"}).status_code == 200
        (entry,) = api.get("/api/v1/audit").json()["items"]
        assert (entry["by"], entry["action"], entry["target"]) == ("engineer", "POST", f"{ALERTS}/1/acknowledge")
        assert entry["details"] == {"note": "mine"}
        lines = list(csv.DictReader(io.StringIO(api.get("/api/v1/audit?by=engineer&format=csv").text)))
        assert lines[0]["details"] == '{"note":"mine"}'
        assert api.get("/api/v1/audit?by=nobody").json()["items"] == []
        assert api.get("/api/v1/audit?before=2020-01-01").json()["items"] == []


def test_an_alert_of_another_cause_stays(api: TestClient, sessions: sessionmaker[Session], code: str) -> None:
    api.post(f"{ALERTS}/1/inspect", json={"outcome": "unfounded", "note": "a load test"})
    with sessions.begin() as session:
        of = session.query(Building).one()
        own = {"onset_event_id": 1, "raised_event_id": 1, "event_ids": (1,)}
        found = [softer_isolators(**own), softer_isolators(cause="damping/y", **own)]
        reconcile(session, of.id, found, "events", NOW + DAY)
    with sessions() as session:
        states = {alert.cause: alert.state for alert in session.query(Alert)}
    assert states == {"stiffness": "withdrawn", "damping": "active", "source": "active"}
