"""Creation, display and acceptance of models in the API."""

import tomllib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import paper_records
import pytest
from api_client import client
from fastapi.testclient import TestClient
from sqlalchemy.orm import Session, sessionmaker

from core.effects import EFFECTS
from service.access import keys
from service.access.auth import Role
from service.buildings import store as building_store
from service.models.tables import ModelVersion

pytestmark = pytest.mark.sqlite

MODELS = "/api/v1/buildings/PAPER/models"
NOW = paper_records.START
LINEAR = {"elastic": {"k_b": 4.75e8}, "viscous": {"c_b": 6e6}}


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session]) -> Iterator[TestClient]:
    """A client for the paper's building, without an earthquake so far."""
    with sessions.begin() as session:
        building_store.add(session, paper_records.building_file(), Path("/"), NOW)
    with client(database_url) as made:
        yield made


def made(api: TestClient, **wanted: object) -> dict[str, Any]:
    answer = api.post(MODELS, json={"direction": "x", **wanted})
    assert answer.status_code == 201, answer.text
    assert api.get(answer.headers["Location"]).json() == answer.json()
    found: dict[str, Any] = answer.json()
    return found


def test_the_first_model_is_made_by_the_design(api: TestClient) -> None:
    first = made(api)
    assert (first["number"], first["state"], first["parent"], first["author"]) == (1, "draft", None, "loopback")
    assert first["effects"] == ["elastic", "viscous"]
    assert first["assumed"] == ["c_b", "k_b"]  # the building's file gives no design values
    assert first["errors"] == {"fitted": None, "held_out": None, "later": None}


def test_a_model_of_given_values(api: TestClient) -> None:
    given = made(api, effects=LINEAR, change="as the maker says")
    assert {one["parameter"]: one["value"] for one in given["values"]} == {"k_b": 4.75e8, "c_b": 6e6}
    assert given["values"][0] | {"unit": "N/m", "std": None} == given["values"][0]
    assert (given["change"], given["assumed"]) == ("as the maker says", [])


REFUSED: tuple[tuple[dict[str, object], int, str], ...] = (
    ({"direction": "y"}, 409, "does not measure direction y; it measures x"),
    ({"direction": "z"}, 422, "direction"),
    ({"effects": {"magic": {}}}, 409, "there is no effect 'magic'"),
    ({"effects": {"elastic": {}}}, 409, "takes values for ['k_b']"),
    ({"effects": {"elastic": {"k_b": -1.0}}}, 409, "must lie within"),
    ({"effects": {"elastic": {"k_b": "stiff"}}}, 422, "number"),
)


@pytest.mark.parametrize(("wanted", "status", "printed"), REFUSED)
def test_what_is_no_model_is_refused_and_reported(
    api: TestClient, wanted: dict[str, object], status: int, printed: str
) -> None:
    refused = api.post(MODELS, json={"direction": "x", **wanted})
    assert refused.status_code == status
    assert printed in refused.json()["detail"]
    assert api.get(MODELS).json()["items"] == []


def test_versions_are_listed_latest_first_page_by_page(api: TestClient) -> None:
    identities = [made(api)["id"] for _ in range(3)]
    first = api.get(MODELS, params={"limit": 2}).json()
    assert [one["id"] for one in first["items"]] == identities[:0:-1]
    second = api.get(MODELS, params={"limit": 2, "cursor": first["next"]}).json()
    assert ([one["number"] for one in second["items"]], second["next"]) == ([1], None)
    assert api.get(MODELS, params={"direction": "xy"}).json()["items"] == []


def test_one_model_at_a_time_is_accepted(api: TestClient) -> None:
    first, second = made(api), made(api, effects=LINEAR)
    for wanted in (first, second, second):
        accepted = api.post(f"/api/v1/models/{wanted['id']}/accept").json()
        assert (accepted["id"], accepted["state"], accepted["accepted_by"]) == (wanted["id"], "current", "loopback")
        in_force = api.get(MODELS, params={"state": "current"}).json()["items"]
        assert [one["id"] for one in in_force] == [wanted["id"]]
    assert api.get(f"/api/v1/models/{first['id']}").json()["state"] == "retired"


def test_a_viewer_reads_and_changes_nothing(api: TestClient, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        roles = {role: keys.create(session, role.name, role, NOW) for role in (Role.engineer, Role.viewer)}
    api.headers["X-API-Key"] = roles[Role.engineer]
    first = made(api)
    assert first["author"] == "engineer"
    api.headers["X-API-Key"] = roles[Role.viewer]
    assert api.get(f"/api/v1/models/{first['id']}").status_code == 200
    for path in (MODELS, f"/api/v1/models/{first['id']}/accept"):
        refused = api.post(path, json={"direction": "x"})
        assert refused.status_code == 403
        assert "role engineer" in refused.json()["detail"]


def test_a_removed_effect_is_still_displayed(api: TestClient, sessions: sessionmaker[Session]) -> None:
    identity = made(api)["id"]
    assert "gone" not in EFFECTS
    with sessions.begin() as session:
        session.get_one(ModelVersion, identity).effects = {"gone": {"b": 2.0, "a": 1.0}}
    found = api.get(f"/api/v1/models/{identity}").json()["values"]
    assert [(one["parameter"], one["value"], one["unit"]) for one in found] == [("a", 1.0, None), ("b", 2.0, None)]


def test_a_version_from_before_an_effect_had_a_value_more_has_the_usual_one(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    friction = {"sliding": 1e6, "share": 0.3, "a": 20.0, "slip": 1e-3}
    number = made(api, effects={**LINEAR, "friction": {**friction, "corner": 5.0}})["id"]
    with sessions.begin() as session:
        session.get_one(ModelVersion, number).effects = {**LINEAR, "friction": friction}
    answer = api.get(f"/api/v1/models/{number}/file")
    assert answer.status_code == 200, answer.text
    stored = tomllib.loads(answer.text)["effects"]["friction"]
    assert stored == {**friction, "corner": 2.0, "sticking": 0.0, "unloading": 0.0}


def test_lineage_begins_with_the_first_model(api: TestClient, sessions: sessionmaker[Session]) -> None:
    line = [made(api)["id"] for _ in range(3)]
    with sessions.begin() as session:
        for parent, child in pairwise(line):
            session.get_one(ModelVersion, child).parent_id = parent
    assert [one["id"] for one in api.get(f"/api/v1/models/{line[1]}/lineage").json()["items"]] == line[:2]
    assert api.get("/api/v1/models/99/lineage").status_code == 404
