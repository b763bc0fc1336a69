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
import numpy as np
import paper_records
import pytest
from alert_candidates import softer_isolators
from alert_fixtures import with_stored_events
from api_client import TestClient, client
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys, links, logins
from service.access.auth import COOKIE, LINK
from service.access.roles import Role
from service.alerts.messages import write_event_message
from service.alerts.reconciliation import reconcile
from service.analyses.tables import Analysis, LayerResult
from service.app import create
from service.buildings import store as building_store
from service.db import sessions as opened
from service.db.blobs import encode
from service.notify.tables import Delivery, Message, Receiver
from service.records.tables import Event
from service.settings import Settings

OPEN = """
GET /healthz
GET /link
GET /login
GET /login/callback
GET /login/provider
POST /login
POST /logout
POST /language
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
GET /api/v1/buildings/{code}/inspections
GET /api/v1/buildings/{code}/messages
GET /api/v1/buildings/{code}/mode-tracks
GET /api/v1/buildings/{code}/models
GET /api/v1/buildings/{code}/modes
GET /api/v1/buildings/{code}/receivers
GET /api/v1/buildings/{code}/reference-periods
GET /api/v1/buildings/{code}/reports/{year}.html
GET /api/v1/buildings/{code}/reports/{year}.pdf
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
GET /api/v1/events/{event_id}/report.html
GET /api/v1/events/{event_id}/report.pdf
GET /api/v1/events/{event_id}/restoring-force
GET /api/v1/events/{event_id}/verdict
GET /api/v1/events/{event_id}/waveforms/{channel}
GET /api/v1/jobs
GET /api/v1/kept-effects
GET /api/v1/kept-effects/{name}/file
GET /api/v1/jobs/{job_id}
GET /api/v1/jobs/{job_id}/progress
GET /api/v1/messages/{message_id}
GET /api/v1/messages/{message_id}/progress
GET /api/v1/models/{model_id}
GET /api/v1/models/{model_id}/comparisons
GET /api/v1/models/{model_id}/diagnoses
GET /api/v1/models/{model_id}/file
GET /api/v1/models/{model_id}/lineage
GET /api/v1/models/{model_id}/trend
GET /api/v1/receivers/{receiver_id}
GET /api/v1/recordings
GET /alerts
GET /buildings/{code}/recordings
GET /api/v1/sources
GET /buildings/{code}
GET /buildings/{code}/alerts
GET /buildings/{code}/drift
GET /buildings/{code}/events
GET /buildings/{code}/messages
GET /buildings/{code}/models
GET /charts/axial-load.{form}
GET /charts/baseline.{form}
GET /charts/cycles.{form}
GET /charts/drift.{form}
GET /charts/force-parts.{form}
GET /charts/loop.{form}
GET /charts/loops.{form}
GET /charts/diagnosis-versions.{form}
GET /charts/effect.{form}
GET /charts/model-diagnosis.{form}
GET /charts/forecast-accelerations.{form}
GET /charts/forecast-displacement.{form}
GET /charts/improvement.{form}
GET /charts/sketch-force.{form}
GET /charts/sketch-law.{form}
GET /charts/sketch-versions.{form}
GET /charts/model-lineage.{form}
GET /charts/model-loop.{form}
GET /charts/model-trend.{form}
GET /charts/model-window.{form}
GET /charts/modes.{form}
GET /charts/orbit.{form}
GET /charts/peaks.{form}
GET /charts/restoring-force.{form}
GET /charts/spectra.{form}
GET /charts/stiffness.{form}
GET /charts/torsion.{form}
GET /charts/waveforms.{form}
GET /diagnoses/{diagnosis_id}
GET /forecasts/{job_id}
GET /sketches/{job_id}
GET /sensors/{job_id}
GET /charts/added-sensors.{form}
GET /sketches/{job_id}/effect
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
GET /jobs/{job_id}
GET /messages/{message_id}
GET /metrics
GET /models/{model_id}
GET /modes
"""
ENGINEER = """
POST /events/{event_id}/analyses
POST /alerts/{alert_id}/acknowledge
POST /alerts/{alert_id}/assign
POST /alerts/{alert_id}/comments
POST /alerts/{alert_id}/inspect
POST /api/v1/alerts/{alert_id}/acknowledge
POST /api/v1/alerts/{alert_id}/assign
POST /api/v1/alerts/{alert_id}/comments
POST /api/v1/alerts/{alert_id}/inspect
GET /api/v1/audit
POST /api/v1/buildings/{code}/drill
POST /api/v1/buildings/{code}/models
POST /api/v1/buildings/{code}/reference-periods
POST /api/v1/buildings/{code}/inspections
POST /api/v1/buildings/{code}/silences
POST /api/v1/deliveries/{delivery_id}/replay
POST /api/v1/events/{event_id}/analyses
DELETE /api/v1/jobs/{job_id}
POST /api/v1/models/{model_id}/accept
POST /api/v1/models/{model_id}/comparisons
POST /api/v1/models/{model_id}/diagnoses
POST /api/v1/models/{model_id}/forecasts
POST /api/v1/models/{model_id}/forecasts/uploaded
POST /api/v1/models/{model_id}/improvements
POST /api/v1/models/{model_id}/sketches
POST /api/v1/buildings/{code}/added-sensors
POST /api/v1/kept-effects
DELETE /api/v1/kept-effects/{name}
POST /api/v1/models/{model_id}/effects
POST /api/v1/models/{model_id}/fits
POST /api/v1/receivers/{receiver_id}/test
POST /api/v1/silences/{silence_id}/end
POST /buildings/{code}/drill
POST /buildings/{code}/inspections
POST /buildings/{code}/models
POST /buildings/{code}/silences
POST /deliveries/{delivery_id}/replay
POST /jobs/{job_id}/cancel
POST /models/{model_id}/accept
POST /models/{model_id}/compare
POST /models/{model_id}/diagnose
POST /models/{model_id}/forecast
POST /models/{model_id}/improve
POST /models/{model_id}/sketch
POST /sketches/{job_id}/keep
POST /buildings/{code}/added-sensors
POST /effects/{name}/delete
POST /models/{model_id}/extend
POST /models/{model_id}/fit
POST /receivers/{receiver_id}/test
POST /silences/{silence_id}/end
"""
ADMIN = """
GET /api/v1/keys
POST /api/v1/keys
DELETE /api/v1/keys/{key_id}
PATCH /api/v1/keys/{key_id}
GET /keys
POST /keys
POST /keys/{key_id}/limit
POST /keys/{key_id}/revoke
GET /api/v1/buildings/{code}/links
POST /api/v1/buildings/{code}/links
POST /api/v1/buildings/{code}/receivers
DELETE /api/v1/links/{link_id}
DELETE /api/v1/receivers/{receiver_id}
PATCH /api/v1/receivers/{receiver_id}
GET /buildings/{code}/links
POST /buildings/{code}/links
POST /buildings/{code}/receivers
POST /links/{link_id}/revoke
POST /receivers/{receiver_id}/remove
"""
LEAST: dict[str, Role | None] = {
    route: role
    for role, routes in ((None, OPEN), (Role.viewer, VIEWER), (Role.engineer, ENGINEER), (Role.admin, ADMIN))
    for route in routes.split("\n")
    if route
}
"""The lowest role of each route; None if no key is needed."""
VALUES = {
    "form": "svg",
    "code": "B",
    "name": "friction",
    "channel": "XX.B.01.HNX",
    "service": "station",
    "key_id": "99",  # not one of those that ask
}
VALUES |= {"year": "2024"}
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
            assert route in ("POST /login", "GET /link") or answer.status_code not in NOT_LET_IN, role
        elif role is None:
            assert answer.status_code == 401 or sent_to_login
        elif role < least:
            assert answer.status_code == 403, role
        else:
            assert answer.status_code not in NOT_LET_IN, role
            assert not sent_to_login


QUERY = {
    "GET /fdsnws/dataselect/1/query": "net=XX&start=2000-01-01&end=2100-01-01",
    "GET /api/v1/buildings/{code}/baseline": "quantity=stiffness&subject=x",
    "GET /api/v1/buildings/{code}/baseline/observations": "quantity=stiffness&subject=x",
    "GET /api/v1/events/{event_id}/restoring-force": "direction=x",
    "GET /charts/axial-load.{form}": "layer=1",
    "GET /charts/baseline.{form}": "building=PAPER&quantity=stiffness&subject=x",
    "GET /charts/drift.{form}": "building=PAPER&quantity=stiffness",
    "GET /charts/added-sensors.{form}": "direction=x&job=1",
    "GET /charts/cycles.{form}": "direction=x&event=1",
    "GET /charts/effect.{form}": "name=friction",
    "GET /charts/force-parts.{form}": "result=1",
    "GET /charts/loop.{form}": "result=1",
    "GET /charts/loops.{form}": "result=1",
    "GET /charts/peaks.{form}": "event=1",
    "GET /charts/spectra.{form}": "event=1",
    "GET /charts/waveforms.{form}": "channel=XX.PAPER.01.HNX&event=1",
    "GET /charts/diagnosis-versions.{form}": "diagnosis=1",
    "GET /charts/model-diagnosis.{form}": "number=1",
    "GET /charts/forecast-accelerations.{form}": "job=1",
    "GET /charts/forecast-displacement.{form}": "job=1",
    "GET /charts/improvement.{form}": "job=1",
    "GET /charts/sketch-force.{form}": "job=1",
    "GET /charts/sketch-law.{form}": "job=1",
    "GET /charts/sketch-versions.{form}": "job=1",
    "GET /charts/model-lineage.{form}": "model=1",
    "GET /charts/model-window.{form}": "comparison=1&start=0",
    "GET /charts/model-loop.{form}": "comparison=1",
    "GET /charts/model-trend.{form}": "model=1",
    "GET /charts/modes.{form}": "building=PAPER&direction=x",
    "GET /charts/orbit.{form}": "layer=1",
    "GET /charts/stiffness.{form}": "building=PAPER&direction=x",
    "GET /charts/restoring-force.{form}": "result=1",
    "GET /charts/torsion.{form}": "layer=1",
    "GET /modes": "building=PAPER&direction=x",
}
"""Queries of routes that need one, or that name a building by it."""
NOT_READY = {"GET /readyz": 503, "GET /login/provider": 502}
"""No poller, worker or notifier runs, and no sign-in provider."""
COMMON = {"name", "service", "form", "key_id"}
"""Parameters of paths that name no building's own: effects, the FDSN services, and keys."""
WITHOUT_BUILDINGS = {
    "GET /login",
    "GET /openapi.json",
    "GET /readyz",
    "GET /docs",
    "GET /effects",
    "GET /api/v1/effects",
    "GET /api/v1/kept-effects",
}
"""Routes whose answer is the same whatever the buildings are."""
NOTHING_THERE = {
    "GET /api/v1/diagnoses/{diagnosis_id}",
    "GET /diagnoses/{diagnosis_id}",
    "GET /forecasts/{job_id}",
    "GET /charts/forecast-accelerations.{form}",
    "GET /charts/forecast-displacement.{form}",
    "GET /charts/improvement.{form}",
    "GET /sketches/{job_id}",
    "GET /sensors/{job_id}",
    "GET /charts/added-sensors.{form}",
    "GET /sketches/{job_id}/effect",
    "GET /charts/sketch-force.{form}",
    "GET /charts/sketch-law.{form}",
    "GET /charts/sketch-versions.{form}",
    "GET /charts/diagnosis-versions.{form}",
    "GET /charts/model-diagnosis.{form}",
    "GET /charts/baseline.{form}",
    "GET /charts/drift.{form}",
    "GET /charts/orbit.{form}",
    "GET /jobs/{job_id}",
}
"""A diagnosis, a forecast or a sketch would take longer than all else here; a baseline needs more events, and the orbit
both directions. The first job analysed an event, which has its own page."""
OF_ADMINISTRATORS = {"GET /api/v1/keys": 403, "GET /keys": 403}
"""Routes that refuse an admin of some buildings, who could make a key of all."""
BODIES = {
    "POST /api/v1/alerts/{alert_id}/acknowledge": {"note": "seen"},
    "POST /api/v1/alerts/{alert_id}/assign": {"to": "Jo"},
    "POST /api/v1/alerts/{alert_id}/comments": {"text": "seen"},
    "POST /api/v1/alerts/{alert_id}/inspect": {"outcome": "confirmed", "note": "seen"},
    "POST /api/v1/buildings/{code}/links": {"name": "a"},
    "POST /api/v1/buildings/{code}/models": {"direction": "x"},
    "POST /api/v1/buildings/{code}/receivers": {"name": "b", "kind": "apprise", "address": "json://127.0.0.1/b"},
    "POST /api/v1/buildings/{code}/reference-periods": {"start": "2010-01-01T00:00:00Z", "reason": "new"},
    "POST /api/v1/buildings/{code}/inspections": {"result": "fit", "comment": "seen"},
    "POST /api/v1/buildings/{code}/silences": {"pattern": "*", "until": "2100-01-01T00:00:00Z", "reason": "works"},
    "POST /api/v1/models/{model_id}/effects": {"effect": "friction"},
    "POST /api/v1/models/{model_id}/forecasts": {"earthquake": 1},
    "PATCH /api/v1/receivers/{receiver_id}": {"kinds": ["event"]},
}


def path_of(route: str, form: str = "svg") -> str:
    """The route's address in the database in use, of a chart in this form."""
    path = re.sub(r"{(\w+)}", lambda one: (VALUES | IN_USE | {"form": form}).get(one[1], "1"), route.split()[1])
    return f"{path}?{QUERY.get(route, '')}"


def names_a_row(route: str) -> bool:
    """True if the path or the query names a row of a building."""
    return bool(set(re.findall(r"{(\w+)}", route)) - COMMON) or bool(re.search("PAPER|=1$", QUERY.get(route, "")))


def across() -> dict[str, bytes]:
    """Short histories across the directions."""
    return dict.fromkeys(("torsion", "torsion_std_history", "axial_load"), encode(np.linspace(0.0, 1e-4, 8)))


ISSUER = "http://127.0.0.1:1"
GRANTS = (
    {"group": "others", "role": "admin", "buildings": ("OTHER",)},
    {"group": "watchers", "role": "viewer", "buildings": ("PAPER",)},
)
OIDC = {"issuer": ISSUER, "client_id": "a", "grants": GRANTS}
"""A sign-in provider that never answers: sessions of people need no more."""


@pytest.fixture
def in_use(sessions: sessionmaker[Session], database_url: str, tmp_path: Path) -> dict[str, dict[str, str]]:
    """Headers of a key of all buildings, of one in use, and of another; of a person who has the other one, and of one
    who may also view the one in use; of a link to the other one. A row of each table belongs to the one in use.
    """
    monitored_building.watch(sessions, tmp_path)
    now = datetime.now(UTC)
    with client(database_url) as asking:
        assert asking.post("/api/v1/buildings/PAPER/models", json={"direction": "x"}).status_code == 201
        assert asking.post("/api/v1/models/1/comparisons", json={}).status_code == 202
        silence = BODIES["POST /api/v1/buildings/{code}/silences"]
        assert asking.post("/api/v1/buildings/PAPER/silences", json=silence).status_code == 201
    monitored_building.work(sessions)
    with sessions.begin() as session:
        event = session.get_one(Event, 1)
        subscribed: dict[str, Any] = {"kinds": ["event"], "severities": ["inform"], "origin": "api"}
        receiver = Receiver(
            building_id=1, name="a", kind="email", address="a@example.org", created_at=now, **subscribed
        )
        session.add(receiver)
        session.flush()
        write_event_message(session, event.id, timedelta(days=1), event.end)
        analysis = session.scalars(select(Analysis.id).where(Analysis.event_id == event.id, Analysis.current)).one()
        session.add(LayerResult(analysis_id=analysis, start=event.start, rate=100.0, count=8, **across()))
        message = session.get_one(Message, 1)
        session.add(Delivery(message=message, receiver=receiver, state="waiting", due_at=now, created_at=now))
        reconcile(session, event.building_id, [with_stored_events(softer_isolators(8.0), (1, 2, 3))], "events", now)
        text = paper_records.building_file().replace("PAPER", "OTHER").replace("the paper's building", "the other one")
        other = building_store.add(session, text, tmp_path, now)
        session.flush()
        links.create(session, event.building, "a", "b", now)
        _, token = links.create(session, other, "a", "b", now)
        limits = {"all": None, "PAPER": ["PAPER"], "OTHER": ["OTHER"]}
        made = {name: keys.create(session, name, Role.admin, now, buildings=codes) for name, codes in limits.items()}
        return {name: {"X-API-Key": key} for name, key in made.items()} | {
            "person": signed_in(session, "others"),
            "both": signed_in(session, "others", "watchers"),
            "link": {"Cookie": f"{LINK}={token}"},
        }


def signed_in(session: Session, *groups: str) -> dict[str, str]:
    """Headers of a person of these groups."""
    now = datetime.now(UTC)
    name = "-".join(groups)
    begun = logins.begin_signed_in(session, f"person:{name}", ISSUER, groups, name, now, now + timedelta(days=1))
    assert begun is not None
    return {"Cookie": f"{COOKIE}={begun.cookie}"}


@pytest.mark.slow
def test_every_route_answers_on_a_database_in_use_and_shows_a_key_its_own_buildings_alone(
    database_url: str, in_use: dict[str, dict[str, str]]
) -> None:
    """Most pages and most of the API are otherwise tested on SQLite alone.

    A row of another building is answered with 404 as if it did not exist, also after a caller of all buildings has
    brought it into memory. The key of the building in use and people ask on SQLite alone. No one changes a building
    of which they are a viewer, although they are an admin of another.
    """
    reads = [route for route in LEAST if route.startswith("GET ")]
    is_sqlite = database_url.startswith("sqlite")

    def form_for(name: str) -> str:
        """Form of the charts: pictures once, otherwise the specifications from which alone they are drawn."""
        return "svg" if is_sqlite and name == "all" else "json"

    provider = {"public_url": "http://127.0.0.1:8000", "oidc": OIDC}
    with client(database_url, progress_patience=0.1, **provider) as asking:
        found = {
            name: {route: asking.get(path_of(route, form_for(name)), headers=headers) for route in reads}
            for name, headers in in_use.items()
            if name in ("all", "OTHER") or (is_sqlite and name != "both")
        }
        changed = {
            f"{route} by {name}": asking.request(*route_and_path(route), json=BODIES.get(route, {}), headers=headers)
            for name, headers in in_use.items()
            if name in ("OTHER", "person", "both", "link")
            for route in LEAST
            if not route.startswith(("GET ", "POST /fdsnws")) and names_a_row(route)
        }
    status = {name: {route: one.status_code for route, one in some.items()} for name, some in found.items()}
    assert {route: one for route, one in status["all"].items() if one >= 500} == NOT_READY
    named = [route for route in reads if names_a_row(route)]
    assert {route for route in named if status["all"][route] != 200} == NOTHING_THERE
    assert {route: status["OTHER"][route] for route in named if status["OTHER"][route] != 404} == {}
    by_link = {route: one.status_code for route, one in changed.items() if route.endswith(" by link")}
    assert set(by_link.values()) == {403}, "it changes nothing at all"
    others = {route: one.status_code for route, one in changed.items() if route not in by_link}
    assert {route: one for route, one in others.items() if one != 404} == {}
    if not is_sqlite:
        return
    assert {route: one for route, one in status["PAPER"].items() if one != status["all"][route]} == OF_ADMINISTRATORS
    assert status["person"] == status["OTHER"]
    for route in named:
        assert status["link"][route] == (404 if LEAST[route] is Role.viewer else 403), route
    for name, hidden in (("OTHER", "PAPER"), ("person", "PAPER"), ("link", "PAPER"), ("PAPER", "OTHER")):
        shown_to = {
            route: one.text for route, one in found[name].items() if one.status_code != 404
        }  # 404 repeats the code
        assert [route for route in shown_to if hidden in shown_to[route]] == []
    shown = [route for route in reads if "PAPER" in found["all"][route].text and route != "GET /api/v1/audit"]
    assert [route for route in shown if "PAPER" not in found["PAPER"][route].text] == []


def route_and_path(route: str) -> tuple[str, str]:
    """Method and address of a route."""
    return route.split()[0], path_of(route)
