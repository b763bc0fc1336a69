"""From an engineer's question to what a model lacks, with its evidence and what it was made from."""

import json
import re
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import monitored_building
import pytest
from api_client import client
from fastapi.testclient import TestClient
from model_jobs import create_model, job_events, work_with_progress
from sqlalchemy import update
from sqlalchemy.orm import Session, sessionmaker

from core.effects import EFFECTS
from service.access import keys
from service.access.auth import Role
from service.models.tables import DiagnosisPicture, ModelDiagnosis

pytestmark = [pytest.mark.slow, pytest.mark.parametrize("database_kind", ["postgresql"], indirect=True)]

FORMER_NAMES = {"noise_ratio": "in_noise_floors", "held_out": "left_out"}
LINEAR = {"elastic": {"k_b": 4.75e8}, "viscous": {"c_b": 6e6}}


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """An engineer's client; the paper's building has had two earthquakes."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", monitored_building.earthquakes()[1:3])
    with client(database_url) as api:
        yield api


def test_a_linear_model_lacks_hysteresis(api: TestClient, sessions: sessionmaker[Session]) -> None:
    """The diagnosis and its page in one test: both need the same costly diagnosis."""
    with sessions.begin() as session:
        of = {
            role: keys.create(session, role.name, role, monitored_building.NOW) for role in (Role.engineer, Role.viewer)
        }
    api.headers["X-API-Key"] = of[Role.engineer]
    model = create_model(api, LINEAR)
    requested = api.post(f"/api/v1/models/{model}/diagnoses", json={"events": [2], "hold_out": [1]})
    with ThreadPoolExecutor(1) as beside:
        beside.submit(work_with_progress, sessions)
        reported = job_events(api, requested.headers["Location"])
    job = reported[-1]
    assert (job["kind"], job["state"], job["progress"]["stages"]) == ("diagnose", "done", 3)
    assert any("step 1: " in one["progress"]["doing"] for one in reported if one["progress"])
    found: dict[str, Any] = api.get(f"/api/v1/diagnoses/{job['result']['diagnosis']}").json()
    assert (found["model"], found["job"], found["author"]) == (model, job["id"], "engineer")
    analyses = [api.get(f"/api/v1/events/{event}").json()["analysis"]["id"] for event in (1, 2)]
    assert (found["fitted"], found["held_out"], found["analyses"]) == ([2], [1], analyses)
    untried = set(EFFECTS) - set(LINEAR) - {one["effect"] for one in found["candidates"]}
    assert all(EFFECTS[name].special for name in untried)  # hysteresis leaves noise: no law that contains a simpler one
    assert "bouc_wen" in found["set"]
    hysteretic = next(one for one in found["candidates"] if one["effect"] == "bouc_wen")
    assert hysteretic["delta_bic"] < -10
    assert hysteretic["error_after_held_out"] < 0.5 * hysteretic["error_before"]
    assert hysteretic["parameters"]["F_y"]["unit"] == "N"
    assert found["versions"][-1]["error_held_out"]["rms"] < found["versions"][1]["error_held_out"]["rms"]
    assert found["explanation"]
    (row,) = api.get(f"/api/v1/models/{model}/diagnoses").json()["items"]
    assert row == {name: found[name] for name in row}
    assert api.get(f"/api/v1/models/{model}").json()["effects"] == list(LINEAR)  # nothing is changed
    assert api.get("/api/v1/models/99/diagnoses").status_code == 404
    assert api.get("/api/v1/diagnoses/99").status_code == 404
    of_diagnosis(api, found)
    of_event(api, found)
    of_model(api, found)
    del api.headers["X-API-Key"]
    api.post("/login", data={"key": of[Role.viewer]})
    seen_by_a_viewer(api, found)
    of_an_earlier_version(api, sessions, found)


def of_diagnosis(api: TestClient, found: dict[str, Any]) -> None:
    """Text, candidates and pictures; `Add` fits the events of the diagnosis."""
    page = api.get(f"/diagnoses/{found['id']}").text
    assert not re.search(r"<script(?! src=./static/\w+\.js.[^<>]*></script>)", page)
    assert page.count(">Add</button>") == len(found["candidates"])
    pictures = re.findall(r'src="(/charts/model-diagnosis.svg[^"]+)"', page)
    assert len(pictures) >= 6  # what diagnosis pictures there are depends on what moved
    for picture in pictures:
        drawn = api.get(picture)
        assert (drawn.headers["content-type"], "<svg" in drawn.text) == ("image/svg+xml", True)
        assert api.get(picture.replace(".svg", ".json")).json()["usermeta"]["dark"]
        assert "</tbody>" in api.get(picture.replace(".svg", ".html")).text
        assert len(api.get(picture.replace(".svg", ".csv")).text.splitlines()) > 5
    versions = api.get(f"/charts/diagnosis-versions.csv?diagnosis={found['id']}").text
    assert all(one["name"] in versions for one in found["versions"])
    fields = dict(re.findall(r'type="hidden" name="([^"]+)" value="([^"]+)"', page))
    sent = api.post(f"/models/{found['model']}/extend", data={**fields, "effect": "bouc_wen"})
    (job,) = api.get("/api/v1/jobs", params={"state": "waiting"}).json()["items"]
    assert (sent.status_code, sent.headers["location"]) == (303, f"/jobs/{job['id']}")
    assert "<progress" in api.get(sent.headers["location"]).text
    assert job["arguments"] == {"events": found["fitted"], "hold_out": found["held_out"], "effect": "bouc_wen"}
    assert api.get("/diagnoses/99").status_code == 404


def of_event(api: TestClient, found: dict[str, Any]) -> None:
    """One button asks what the current model lacks; the page of its job leads to the result."""
    api.post(f"/api/v1/models/{found['model']}/accept")
    page = api.get("/events/2").text
    assert re.search(r'name="use_2" value="fit" checked', page)
    (action,) = re.findall(r'<form method="post" action="(/models/\d+/diagnose)">', page)
    uses = dict(re.findall(r'type="radio" name="(use_\d+)" value="(\w+)" checked', page))
    assert set(uses) == {"use_1", "use_2"}
    sent = api.post(action, data=uses | {"use_1": "hold_out", "follow": "1"})
    number = int(sent.headers["location"].removeprefix("/jobs/"))
    assert api.get(f"/api/v1/jobs/{number}").json()["arguments"] == {"events": [2], "hold_out": [1]}
    assert "<progress" in api.get(f"/jobs/{number}").text
    api.post(f"/jobs/{number}/cancel")
    assert "It was cancelled" in api.get(f"/jobs/{number}").text
    assert api.get(f"/jobs/{found['job']}").headers["location"] == f"/diagnoses/{found['id']}"
    assert api.get("/jobs/1").headers["location"] == "/events/1", "it analysed an event"


def of_an_earlier_version(api: TestClient, sessions: sessionmaker[Session], found: dict[str, Any]) -> None:
    """Its numbers are read under the names they had, and its pictures are shown as they were stored."""
    with sessions.begin() as session:
        session.execute(update(DiagnosisPicture).values(svg="<svg>as it was</svg>", spec=None))
        stored = session.get_one(ModelDiagnosis, found["id"])
        document = json.dumps(stored.document)
        for name, former in FORMER_NAMES.items():
            assert f'"{name}":' in document
            document = document.replace(f'"{name}":', f'"{former}":')
        stored.document = json.loads(document)
    assert api.get(f"/api/v1/diagnoses/{found['id']}").json() == found
    page = api.get(f"/diagnoses/{found['id']}").text
    assert "model-diagnosis.json" not in page
    pictures = re.findall(r'src="(/charts/model-diagnosis.svg[^"]+)"', page)
    assert {api.get(one).text for one in pictures} == {"<svg>as it was</svg>"}
    assert api.get(pictures[0].replace(".svg", ".json")).status_code == 404


def of_model(api: TestClient, found: dict[str, Any]) -> None:
    """Its diagnoses, and buttons that ask for more with what is ticked left out."""
    page = api.get(f"/models/{found['model']}").text
    assert f'href="/diagnoses/{found["id"]}"' in page
    assert "hold out <time" in page
    for action in ("fit", "diagnose"):
        assert api.post(f"/models/{found['model']}/{action}", data={"hold_out_2": "on"}).status_code == 303
        job = api.get("/api/v1/jobs", params={"state": "waiting"}).json()["items"][0]
        assert (job["kind"], job["arguments"]) == (action, {"events": None, "hold_out": [2]})
    refused = api.post(f"/models/{found['model']}/fit", data={"hold_out_x": "on"})
    assert "no event &#39;x&#39;" in refused.text


def seen_by_a_viewer(api: TestClient, found: dict[str, Any]) -> None:
    """All of it, but nothing to press."""
    assert "<button name=" not in api.get(f"/diagnoses/{found['id']}").text.partition("<footer>")[0]
    page = api.get(f"/models/{found['model']}").text
    assert "What it lacks" in page
    assert "Improve it" not in page
    for action in ("fit", "diagnose", "extend"):
        assert api.post(f"/models/{found['model']}/{action}", data={"effect": "friction"}).status_code == 403
