"""Physical effects in the API."""

from collections.abc import Iterator
from pathlib import Path

import databases
import pytest
from api_client import client
from fastapi.testclient import TestClient

from core.effects import EFFECTS


@pytest.fixture
def api(tmp_path: Path) -> Iterator[TestClient]:
    url = databases.sqlite(tmp_path)
    with client(url) as made:
        yield made


def test_every_effect_is_listed_by_family(api: TestClient) -> None:
    found = api.get("/api/v1/effects").json()["items"]
    assert {one["name"] for one in found} == set(EFFECTS)
    families = [one["family"] for one in found]
    assert families == sorted(families)
    lines = api.get("/api/v1/effects", params={"format": "csv"}).text.splitlines()
    assert len(lines) == len(EFFECTS) + 1


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_every_effect_is_explained(api: TestClient, name: str) -> None:
    found = api.get(f"/api/v1/effects/{name}").json()
    parameters = {one["name"]: one for one in found["parameters"]}
    assert set(found["absent"]) <= set(parameters)
    assert all(one["lowest"] <= one["usual"] <= one["highest"] for one in parameters.values())
    assert "{" not in found["explanation"]
    assert found["law"].startswith("def law(")


def test_an_effect_that_there_is_not(api: TestClient) -> None:
    assert api.get("/api/v1/effects/magic").json()["detail"] == "There is no effect 'magic'."
