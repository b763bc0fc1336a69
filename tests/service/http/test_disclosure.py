"""Data hidden from viewers, and cells that a spreadsheet must not run."""

import csv
import io
import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import databases
import pytest
from api_client import TestClient, client
from monitoring_server import building_file
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auditing import AuditContext, note
from service.access.roles import Role
from service.alerts.tables import Silence
from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.db import sessions as opened
from service.jobs.tables import Job
from service.notify.tables import DeliveryAttempt

NOW = datetime(2024, 1, 1, tzinfo=UTC)
TRACEBACK = """Traceback (most recent call last):
  File "/srv/menshin/service/jobs/worker.py", line 1, in _take
ValueError: /srv/menshin/data/a.mseed holds nothing
"""


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    return databases.sqlite(tmp_path_factory.mktemp("seen"))


@pytest.fixture(scope="module")
def stored(url: str) -> Iterator[sessionmaker[Session]]:
    made = opened.sessions(url)
    with made.begin() as session:
        building = building_store.add(session, building_file("folder", "/"), Path("/"), NOW)
        for number in range(3):
            times = {"starts_at": NOW, "ends_at": NOW, "created_at": NOW}
            session.add(
                Silence(building=building, pattern='=HYPERLINK("//evil")', reason=f"-{number}+1", by="@me", **times)
            )
            session.add(
                Job(
                    kind="watch",
                    building_id=building.id,
                    arguments={},
                    state="failed",
                    error=TRACEBACK,
                    created_at=NOW + timedelta(seconds=number),
                )
            )
    yield made
    made.kw["bind"].dispose()


@pytest.fixture(scope="module")
def engineer(stored: sessionmaker[Session]) -> dict[str, str]:
    """Headers of an engineer."""
    with stored.begin() as session:
        return {"X-API-Key": keys.create(session, "engineer", Role.engineer, NOW)}


@pytest.fixture(scope="module")
def api(url: str, stored: sessionmaker[Session], engineer: dict[str, str]) -> Iterator[TestClient]:
    with stored.begin() as session:
        key = keys.create(session, "viewer", Role.viewer, NOW)
    with client(url, visitor=None) as made:
        made.headers["X-API-Key"] = key
        yield made


def test_a_spreadsheet_runs_no_cell(api: TestClient) -> None:
    text = api.get("/api/v1/buildings/TOWER/silences?format=csv").text
    rows = list(csv.DictReader(io.StringIO(text)))
    assert {row["pattern"] for row in rows} == {'\'=HYPERLINK("//evil")'}
    assert {row["reason"] for row in rows} == {"'-0+1", "'-1+1", "'-2+1"}
    assert {row["by"] for row in rows} == {"'@me"}
    assert {row["id"] for row in rows} == {"1", "2", "3"}, "a number stays one"


def test_no_answer_names_the_host_that_was_requested(
    api: TestClient, stored: sessionmaker[Session], engineer: dict[str, str]
) -> None:
    with stored.begin() as session:
        for _ in range(2):
            note(session, AuditContext("me", "here", "POST", "/", {}), NOW)
    link = api.get("/api/v1/audit?limit=1", headers=engineer | {"Host": "evil.example"}).headers["link"]
    assert re.fullmatch(r'</api/v1/audit\?limit=1&cursor=\d+>; rel="next"', link)
    answer = api.get("/fdsnws/station/1/application.wadl", headers={"Host": "evil.example"})
    assert "evil" not in answer.text
    assert "evil" not in api.get("/fdsnws/station/1/query?colour=1", headers={"Host": "evil.example"}).text


def test_a_failed_jobs_error_names_no_path(api: TestClient) -> None:
    jobs = api.get("/api/v1/jobs").json()["items"]
    assert {job["error"] for job in jobs} == {"ValueError: (a file) holds nothing"}


def test_viewers_see_neither_where_receivers_are_nor_what_they_answered(
    api: TestClient, stored: sessionmaker[Session], engineer: dict[str, str]
) -> None:
    with stored.begin() as session:
        building = building_store.find(session, "TOWER")
        rule = ReceiverRule("manager", "email", "manager@example.org", None, WANTED_KINDS, SEVERITIES)
        recipients.add(session, building.id, rule, "admin", NOW)
    sent = api.post("/api/v1/receivers/1/test", headers=engineer)
    number = sent.json()["id"]
    with stored.begin() as session:
        session.add(
            DeliveryAttempt(
                delivery_id=number,
                number=1,
                address="manager@example.org",
                is_repeat=False,
                begun_at=NOW,
                outcome="not_taken",
                answer="550 inside.example says no",
            )
        )
    paths = (
        "/api/v1/buildings/TOWER/receivers",
        "/api/v1/receivers/1",
        "/api/v1/deliveries",
        f"/api/v1/deliveries/{number}",
        f"/api/v1/messages/{sent.json()['message']}",
        "/buildings/TOWER/messages",
        f"/messages/{sent.json()['message']}",
    )
    for path in paths:
        for hidden in ("manager@example.org", "inside.example"):
            assert hidden not in api.get(path).text, path
    for_engineers = api.get(paths[3], headers=engineer).text
    assert "manager@example.org" in for_engineers
    assert "inside.example" in for_engineers
