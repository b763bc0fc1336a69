"""Pages of models and effects, and their forms without JavaScript."""

import re
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import paper_records
import pytest
from api_client import client
from fastapi.testclient import TestClient
from sqlalchemy.orm import Session, sessionmaker

from core.effects import EFFECTS
from service.access import keys
from service.access.auth import Role
from service.buildings import store as building_store
from service.models.model_file import read
from service.models.pages.pictures import falls
from service.models.windows import SHOWN, worst_windows

pytestmark = pytest.mark.sqlite

NOW = paper_records.START
MODELS = "/buildings/PAPER/models"


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session]) -> Iterator[TestClient]:
    with sessions.begin() as session:
        building_store.add(session, paper_records.building_file(), Path("/"), NOW)
    with client(database_url) as made:
        yield made


def shown(api: TestClient, path: str) -> str:
    answer = api.get(path)
    assert answer.status_code == 200, answer.text
    assert not re.search(r"<script(?! src=./static/\w+\.js.[^<>]*></script>)", answer.text)
    return unescape(re.sub(r"\s+", " ", re.sub("<[^>]+>", " ", answer.text)))


def test_a_form_makes_the_first_model_and_shows_it(api: TestClient) -> None:
    assert "None yet." in shown(api, MODELS)
    sent = api.post(MODELS, data={"direction": "x"})
    assert (sent.status_code, sent.headers["location"]) == (303, "/models/1")
    page = shown(api, "/models/1")
    assert "model x 1, draft" in page
    assert "from the design values" in page
    assert "kN/mm stiffness of the rubber after yield (assumed, as the start of a fit)" in page
    assert "not been compared with any event yet" in page
    assert "x 1 draft" in shown(api, MODELS)
    assert api.post(MODELS, data={"direction": "up"}).status_code == 409


def test_values_are_shown_in_the_units_of_engineers(api: TestClient) -> None:
    values = {"elastic": {"k_b": 4.75e8}, "viscous": {"c_b": 6e6}}
    api.post("/api/v1/buildings/PAPER/models", json={"direction": "x", "effects": values})
    page = shown(api, "/models/1")
    assert "k_b 475 kN/mm" in page
    assert "c_b 6 kN s/mm" in page


def test_a_form_accepts_a_model(api: TestClient) -> None:
    api.post(MODELS, data={"direction": "x"})
    assert api.post("/models/1/accept").headers["location"] == "/models/1"
    page = shown(api, "/models/1")
    assert "made current by loopback" in page
    assert "Make current" not in page


def test_an_earlier_version_is_made_current_again(api: TestClient) -> None:
    for number in (1, 2):
        api.post(MODELS, data={"direction": "x"})
        api.post(f"/models/{number}/accept")
    assert "Go back to x 1" in shown(api, "/models/2")
    assert 'formaction="/models/1/accept">Go back' in api.get("/models/2").text
    api.post("/models/1/accept")
    assert "Make current again" in shown(api, "/models/2")
    assert [one["state"] for one in api.get("/api/v1" + MODELS).json()["items"]] == ["retired", "current"]


def test_a_version_is_exported_as_the_file_that_commands_read(api: TestClient) -> None:
    api.post(MODELS, data={"direction": "x"})
    answer = api.get("/api/v1/models/1/file")
    assert answer.headers["content-type"].startswith("application/toml")
    file, values = read(answer.text), api.get("/api/v1/models/1").json()["values"]
    assert (file.building, file.direction) == ("PAPER", "x")
    assert {(one["effect"], one["parameter"]): one["value"] for one in values} == {
        (effect, name): value for effect, own in file.isolator.effects.items() for name, value in own.items()
    }
    assert api.get("/api/v1/models/9/file").status_code == 404


def test_the_worst_parts_of_a_record_are_those_with_the_largest_residual() -> None:
    rate, time = 20.0, np.arange(0.0, 42.0, 1 / 20.0)
    residual = np.where((time >= 15.0) & (time < 20.0), 3e3, 1e3)
    windows = worst_windows(0.01 * time, 1e6 * np.sin(time) + residual, 1e6 * np.sin(time), rate)
    assert (windows[0].start, windows[0].error) == (15.0, pytest.approx(3e3))
    assert windows[0].share == pytest.approx(5 * 9 / (5 * 9 + 37))
    assert windows[0].amplitude == pytest.approx(0.01 * (20.0 - 1 / rate))
    assert len(windows) == SHOWN


def test_bars_show_what_each_change_removed_and_never_less_than_nothing() -> None:
    errors = [("x 1", {"fitted": 0.10, "held out": None}), ("x 2", {"fitted": 0.02, "held out": 0.03})]
    spec = falls([*errors, ("x 3", {"fitted": 0.05, "held out": 0.01})]).to_dict()
    rows = [(one["version"], one["group"], one["error"], one["before"]) for one in rows_of(spec)]
    assert rows == [
        ("x 1", "fitted", 10.0, 10.0),
        ("x 2", "fitted", 2.0, 10.0),
        ("x 2", "held out", 3.0, 3.0),
        ("x 3", "fitted", 5.0, 5.0),
        ("x 3", "held out", 1.0, 3.0),
    ]


def rows_of(spec: dict[str, Any]) -> list[dict[str, Any]]:
    (rows,) = spec["datasets"].values()
    return list(rows)


def test_what_cannot_be_is_refused(api: TestClient) -> None:
    api.post(MODELS, data={"direction": "x"})
    refused = api.post("/models/1/compare")
    assert refused.status_code == 409
    assert re.search(r'role="alert">\s*<p><b>Not accepted.</b> No event can be compared', refused.text)
    assert api.get("/models/1", params={"comparison": 5}).status_code == 404
    assert api.get("/models/2").status_code == 404


def test_a_viewer_sees_no_form_and_another_sites_form_does_nothing(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        key = keys.create(session, "viewer", Role.viewer, NOW)
    assert api.get(MODELS).headers["location"] == "/login?next=%2Fbuildings%2FPAPER%2Fmodels"
    assert api.post("/login", data={"key": key, "next": MODELS}).headers["location"] == MODELS
    assert "New model" not in shown(api, MODELS)
    assert api.post(MODELS, data={"direction": "x"}).status_code == 403
    foreign = api.post(MODELS, data={"direction": "x"}, headers={"Origin": "https://elsewhere.example"})
    assert "another site" in foreign.json()["detail"]


def test_every_effect_has_a_page(api: TestClient) -> None:
    overview = api.get("/effects").text
    for name, effect in EFFECTS.items():
        assert f'href="/effects/{name}"' in overview
        page = shown(api, f"/effects/{name}")
        for printed in (effect.title, effect.suspect_when, *(one.meaning for one in effect.parameters)):
            assert printed in page, (name, printed)
    assert api.get("/effects/magic").status_code == 404
