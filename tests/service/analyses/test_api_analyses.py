"""Requests for another analysis of an event: roles and arguments."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import monitored_building
import pytest
from api_server import api_server
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auth import Role

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]

AGAIN = "/api/v1/events/1/analyses"


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[httpx.Client]:
    """An engineer's client; the building has had one earthquake."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", monitored_building.earthquakes()[:1])
    with sessions.begin() as session:
        key = keys.create(session, "engineer", Role.engineer, monitored_building.NOW)
    with api_server(database_url) as address, httpx.Client(base_url=address, timeout=30) as client:
        client.headers["X-API-Key"] = key
        yield client


def test_an_engineer_has_an_event_analysed_again(api: httpx.Client, sessions: sessionmaker[Session]) -> None:
    requested = api.post(AGAIN, json={"sensors": ["base", "roof"], "band": [0.2, 20.0]})
    assert requested.status_code == 202
    assert requested.json()["arguments"] == {"sensors": ["1F", "RF"], "band": [0.2, 20.0]}
    assert api.get(requested.headers["Location"]).json() == requested.json()
    twice = api.post(AGAIN, json={"sensors": ["1F", "RF"], "band": [0.2, 20.0]})
    assert twice.json()["id"] == requested.json()["id"]
    monitored_building.work(sessions)
    event = api.get("/api/v1/events/1").json()
    assert event["analysis"]["settings"]["sensors"] == ["1F", "RF"]
    (earlier,) = event["earlier"]
    assert not earlier["current"]
    before = api.get("/api/v1/events/1", params={"analysis": earlier["id"]}).json()
    assert before["directions"][0]["peak_force"] != event["directions"][0]["peak_force"]


REFUSED: tuple[tuple[dict[str, object], int, str], ...] = (
    ({"sensors": ["base", "9F"]}, 409, "no level '9F'; there are ground, base, roof, 1F, 2F"),
    ({"sensors": ["3F", "roof"]}, 409, "base slab must be among them"),
    ({"sensors": ["base", "1F"]}, 409, "above the base slab"),
    ({"band": [0.1, 50.0]}, 409, "does not fit 100 Hz"),
    ({"rate": 50.0}, 409, "does not fit 50 Hz"),
    ({"estimator": "guess"}, 422, "there are cms"),
    ({"band": [30.0, 0.1]}, 422, "band"),
    ({"rate": "fast"}, 422, "rate"),
    ({"colour": "red"}, 422, "colour"),
)


def test_what_cannot_be_is_refused_and_reported(api: httpx.Client) -> None:
    for wanted, status, printed in REFUSED:
        found = api.post(AGAIN, json=wanted)
        assert (found.status_code, found.headers["content-type"]) == (status, "application/problem+json"), wanted
        assert printed in found.json()["detail"]
    assert api.post("/api/v1/events/9/analyses", json={}).status_code == 404
    assert api.get("/api/v1/jobs", params={"state": "waiting"}).json()["items"] == []


def test_engineers_cancel_their_own_jobs_and_admins_all(api: httpx.Client, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        others = {role: keys.create(session, role.name + " two", role, monitored_building.NOW) for role in Role}
    for role, status in ((Role.viewer, 403), (Role.engineer, 403), (Role.admin, 200)):
        requested = api.post(AGAIN, json={"estimator": "cms"})
        answer = api.delete(requested.headers["Location"], headers={"X-API-Key": others[role]})
        assert answer.status_code == status, answer.text
    assert answer.json()["state"] == "cancelled"
    assert api.get("/api/v1/events/1").json()["state"] == "analysed"
    own = api.post(AGAIN, json={"estimator": "cms"}).headers["Location"]
    assert api.delete(own).json()["state"] == "cancelled"
    assert api.delete(own).status_code == 409
    assert api.delete("/api/v1/jobs/1").status_code == 409, "the earthquake's first analysis"
    assert api.delete("/api/v1/jobs/999").status_code == 404
    with httpx.stream("GET", f"{api.base_url}{own}/progress", headers=api.headers) as stream:
        assert '"cancelled"' in stream.read().decode(), "a stream ends with its job"


def test_a_viewer_may_not_ask_for_it(api: httpx.Client, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        viewer = keys.create(session, "viewer", Role.viewer, monitored_building.NOW)
    refused = api.post(AGAIN, json={}, headers={"X-API-Key": viewer})
    assert (refused.status_code, refused.json()["status"]) == (403, 403)
    assert "role engineer" in refused.json()["detail"]


def test_a_wrong_key_beside_a_right_one_is_refused(api: httpx.Client) -> None:
    for authorization in ("Bearer wrong", "Basic wrong", ""):
        refused = api.get("/api/v1/buildings", headers={"Authorization": authorization})
        assert refused.status_code == 401, authorization
