"""Comments on alerts and their assignment: on the alert, in the list, on the building's page and in the API."""

from datetime import timedelta

import pytest
from alert_candidates import START
from alert_fixtures import building, raise_softening
from api_client import client
from sqlalchemy.orm import Session, sessionmaker

from service.access.roles import Caller, Role
from service.access.tables import AuditEntry
from service.alerts import operator_actions
from service.alerts.tables import Alert

pytestmark = pytest.mark.sqlite

HOSTILE = "<i>Jo</i>"


@pytest.fixture
def code(sessions: sessionmaker[Session]) -> str:
    """A building with one active alert, number 1."""
    with sessions.begin() as session:
        of = building(session)
        raise_softening(session, of)
        return of.code


def test_a_comment_and_the_person_who_looks_after_an_alert_are_seen_wherever_it_is(
    database_url: str, sessions: sessionmaker[Session], code: str
) -> None:
    with client(database_url) as asking:
        assert "Not assigned yet." in asking.get("/alerts/1").text
        for _ in range(2):  # the second time it is there already
            made = asking.post("/alerts/1/comments", data={"text": "waits for <b>parts</b>", "name": HOSTILE})
            assert (made.status_code, made.headers["location"]) == (303, "/alerts/1")
        assert asking.post("/api/v1/alerts/1/assign", json={"to": HOSTILE}).status_code == 200
        pages = {
            path: asking.get(path).text for path in ("/alerts/1", f"/buildings/{code}/alerts", f"/buildings/{code}")
        }
        alert = asking.get("/api/v1/alerts/1").json()
        (line,) = asking.get("/api/v1/alerts").json()["items"]
    for path, page in pages.items():
        assert "&lt;i&gt;Jo&lt;/i&gt;" in page, path
        assert "<i>Jo" not in page, path
        assert "<b>parts" not in page, path
    assert "1 comment</small>" in pages[f"/buildings/{code}/alerts"]
    assert "waits for &lt;b&gt;parts&lt;/b&gt;" in pages[f"/buildings/{code}"]
    assert (alert["assigned_to"], line["assigned_to"]) == (HOSTILE, HOSTILE)
    assert [(one["by"], one["text"], one["assigned_to"]) for one in alert["comments"]] == [
        (f"{HOSTILE} (loopback)", "waits for <b>parts</b>", None),
        ("loopback", "", HOSTILE),
    ]
    with sessions() as session:
        assert session.query(AuditEntry).count() == 2


def test_an_ended_alert_is_commented_on_but_not_assigned_and_a_viewer_does_neither(
    database_url: str, sessions: sessionmaker[Session], code: str
) -> None:
    with client(database_url, visitor=Caller("guest", Role.viewer)) as asking:
        assert asking.post("/alerts/1/comments", data={"text": "hello"}).status_code == 403
        assert asking.post("/api/v1/alerts/1/assign", json={"to": "Jo"}).status_code == 403
        assert "Write a comment" not in asking.get("/alerts/1").text
    with sessions.begin() as session:
        alert = session.get_one(Alert, 1)
        operator_actions.inspect(session, alert, "Jo", "confirmed", "replaced", None, START + timedelta(days=9))
    with client(database_url) as asking:
        assert asking.post("/alerts/1/comments", data={"text": "the bill came"}).status_code == 303
        assert asking.post("/api/v1/alerts/1/assign", json={"to": "Jo"}).status_code == 409
        refused = asking.post("/alerts/1/comments", data={"text": " "})
        assert refused.status_code == 409
        assert "Not accepted." in refused.text
        page = asking.get("/alerts/1").text
    assert "the bill came" in page
    assert "Assign it" not in page
