"""The role that each route needs: all routes, for every caller.

A route that is not in this table fails the test: whoever adds one decides who may use it.
"""

import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import databases
import monitored_building
import pytest
from api_client import TestClient, client
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.roles import Role
from service.alerts.messages import write_event_message
from service.app import create
from service.db import sessions as opened
from service.records.tables import Event
from service.settings import Settings

OPEN = """
GET /healthz
GET /login
POST /login
POST /logout
GET /openapi.json
GET /readyz
GET /static/libraries/{name}
"""
VIEWER = """
GET /
GET /alerts/{alert_id}
GET /api/v1/alerts
GET /api/v1/alerts/{alert_id}
GET /api/v1/buildings
GET /api/v1/buildings/{code}
GET /api/v1/buildings/{code}/baseline
GET /api/v1/buildings/{code}/baseline/observations
GET /api/v1/buildings/{code}/drift
GET /api/v1/buildings/{code}/drift-alarms
GET /api/v1/buildings/{code}/equivalent
GET /api/v1/buildings/{code}/events
GET /api/v1/buildings/{code}/messages
GET /api/v1/buildings/{code}/mode-tracks
GET /api/v1/buildings/{code}/models
GET /api/v1/buildings/{code}/modes
GET /api/v1/buildings/{code}/receivers
GET /api/v1/buildings/{code}/reference-periods
GET /api/v1/buildings/{code}/silences
GET /api/v1/buildings/{code}/verdict
GET /api/v1/buildings/{code}/watched
GET /api/v1/comparisons/{comparison_id}
GET /api/v1/comparisons/{comparison_id}/force
GET /api/v1/deliveries
GET /api/v1/deliveries/{delivery_id}
GET /api/v1/diagnoses/{diagnosis_id}
GET /api/v1/effects
GET /api/v1/effects/{name}
GET /api/v1/events/{event_id}
GET /api/v1/events/{event_id}/layer-motion
GET /api/v1/events/{event_id}/restoring-force
GET /api/v1/events/{event_id}/verdict
GET /api/v1/events/{event_id}/waveforms/{channel}
GET /api/v1/jobs
GET /api/v1/jobs/{job_id}
GET /api/v1/jobs/{job_id}/progress
GET /api/v1/messages/{message_id}
GET /api/v1/messages/{message_id}/progress
GET /api/v1/models/{model_id}
GET /api/v1/models/{model_id}/comparisons
GET /api/v1/models/{model_id}/diagnoses
GET /api/v1/models/{model_id}/lineage
GET /api/v1/models/{model_id}/trend
GET /api/v1/receivers/{receiver_id}
GET /api/v1/recordings
GET /alerts
GET /buildings/{code}/recordings
GET /api/v1/sources
GET /buildings/{code}/alerts
GET /buildings/{code}/drift
GET /buildings/{code}/events
GET /buildings/{code}/messages
GET /buildings/{code}/models
GET /charts/axial-load.{form}
GET /charts/baseline.{form}
GET /charts/drift.{form}
GET /charts/loop.{form}
GET /charts/model-diagnosis.svg
GET /charts/model-loop.{form}
GET /charts/model-trend.{form}
GET /charts/modes.{form}
GET /charts/orbit.{form}
GET /charts/restoring-force.{form}
GET /charts/stiffness.{form}
GET /charts/torsion.{form}
GET /diagnoses/{diagnosis_id}
GET /docs
GET /effects
GET /effects/{name}
GET /events/{event_id}
GET /fdsnws/dataselect/1/query
POST /fdsnws/dataselect/1/query
GET /fdsnws/station/1/query
POST /fdsnws/station/1/query
GET /fdsnws/{service}/1/application.wadl
GET /fdsnws/{service}/1/version
GET /messages/{message_id}
GET /metrics
GET /models/{model_id}
GET /modes
"""
ENGINEER = """
POST /alerts/{alert_id}/acknowledge
POST /alerts/{alert_id}/inspect
POST /api/v1/alerts/{alert_id}/acknowledge
POST /api/v1/alerts/{alert_id}/inspect
GET /api/v1/audit
POST /api/v1/buildings/{code}/drill
POST /api/v1/buildings/{code}/models
POST /api/v1/buildings/{code}/reference-periods
POST /api/v1/buildings/{code}/silences
POST /api/v1/deliveries/{delivery_id}/replay
POST /api/v1/events/{event_id}/analyses
DELETE /api/v1/jobs/{job_id}
POST /api/v1/models/{model_id}/accept
POST /api/v1/models/{model_id}/comparisons
POST /api/v1/models/{model_id}/diagnoses
POST /api/v1/models/{model_id}/effects
POST /api/v1/models/{model_id}/fits
POST /api/v1/receivers/{receiver_id}/test
POST /api/v1/silences/{silence_id}/end
POST /buildings/{code}/drill
POST /buildings/{code}/models
POST /buildings/{code}/silences
POST /deliveries/{delivery_id}/replay
POST /jobs/{job_id}/cancel
POST /models/{model_id}/accept
POST /models/{model_id}/compare
POST /models/{model_id}/diagnose
POST /models/{model_id}/extend
POST /models/{model_id}/fit
POST /receivers/{receiver_id}/test
POST /silences/{silence_id}/end
"""
ADMIN = """
POST /api/v1/buildings/{code}/receivers
DELETE /api/v1/receivers/{receiver_id}
PATCH /api/v1/receivers/{receiver_id}
POST /buildings/{code}/receivers
POST /receivers/{receiver_id}/remove
"""
LEAST: dict[str, Role | None] = {
    route: role
    for role, routes in ((None, OPEN), (Role.viewer, VIEWER), (Role.engineer, ENGINEER), (Role.admin, ADMIN))
    for route in routes.split("\n")
    if route
}
"""The lowest role of each route; None if no key is needed."""
VALUES = {"form": "svg", "code": "B", "name": "friction", "channel": "XX.B.01.HNX", "service": "station"}
"""Values of the parameters in paths; all others are numbers."""
IN_USE = {"code": "PAPER", "channel": "XX.PAPER.01.HNX"}
"""Values in a database in use."""
NOT_LET_IN = {401, 403}


def every(routes: Any, prefix: str = "") -> Iterator[str]:  # noqa: ANN401  FastAPI's own, by version
    """`METHOD path` of all routes of an application."""
    for route in routes:
        if hasattr(route, "original_router"):
            yield from every(route.original_router.routes, prefix + (route.include_context.prefix or ""))
        elif hasattr(route, "methods"):
            yield from (f"{method} {prefix}{route.path}" for method in route.methods - {"HEAD"})


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    return databases.sqlite(tmp_path_factory.mktemp("roles"))


@pytest.fixture(scope="module")
def key(url: str) -> dict[Role | None, dict[str, str]]:
    """Headers of everybody who may ask."""
    sessions = opened.sessions(url)
    with sessions.begin() as session:
        made = {role: keys.create(session, role.name, role, datetime.now(UTC)) for role in Role}
    sessions.kw["bind"].dispose()
    return {None: {}} | {role: {"X-API-Key": one} for role, one in made.items()}


@pytest.fixture(scope="module")
def api(url: str) -> Iterator[TestClient]:
    with client(url, visitor=None) as made:
        yield made


def test_every_route_has_its_role(url: str) -> None:
    assert set(every(create(Settings(database_url=url)).routes)) == set(LEAST)


@pytest.mark.parametrize("route", LEAST)
def test_a_route_admits_its_role_and_higher_ones(
    api: TestClient, key: dict[Role | None, dict[str, str]], route: str
) -> None:
    method, path = route.split()
    requested = re.sub(r"{(\w+)}", lambda found: VALUES.get(found[1], "1"), path)
    for role in (None, *Role):
        answer = api.request(method, requested, headers=key[role])
        least = LEAST[route]
        sent_to_login = answer.status_code == 303 and answer.headers["location"].startswith("/login?")
        if least is None:
            assert route == "POST /login" or answer.status_code not in NOT_LET_IN, role
        elif role is None:
            assert answer.status_code == 401 or sent_to_login
        elif role < least:
            assert answer.status_code == 403, role
        else:
            assert answer.status_code not in NOT_LET_IN, role
            assert not sent_to_login


QUERY = {"GET /fdsnws/dataselect/1/query": "net=XX&start=2000-01-01&end=2100-01-01"}
"""Queries of routes that need one."""
NOT_READY = {"GET /readyz": 503}
"""No poller, worker or notifier runs."""


@pytest.mark.slow
def test_every_route_answers_on_a_database_in_use(
    sessions: sessionmaker[Session], database_url: str, tmp_path: Path
) -> None:
    """Most pages and most of the API are otherwise tested on SQLite alone."""
    monitored_building.watch(sessions, tmp_path)
    with sessions.begin() as session:
        event = session.get_one(Event, 1)
        write_event_message(session, event.id, timedelta(days=1), event.end)
    found = {}
    with client(database_url, progress_patience=0.1) as asking:
        assert asking.post("/api/v1/buildings/PAPER/models", json={"direction": "x"}).status_code == 201
        assert asking.post("/api/v1/models/1/comparisons", json={}).status_code == 202
        monitored_building.work(sessions)
        for route in (route for route in LEAST if route.startswith("GET ")):
            path = re.sub(r"{(\w+)}", lambda one: (VALUES | IN_USE).get(one[1], "1"), route.removeprefix("GET "))
            found[route] = asking.get(f"{path}?{QUERY.get(route, '')}").status_code
    assert {route: status for route, status in found.items() if status >= 500} == NOT_READY
