"""From an engineer's question to what a model lacks, with its evidence and what it was made from."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import watched
from asking import client
from engineer import done, made
from fastapi.testclient import TestClient
from sqlalchemy.orm import Session, sessionmaker

from core.effects import EFFECTS

pytestmark = [pytest.mark.slow, pytest.mark.parametrize("empty_database_url", ["postgresql"], indirect=True)]

LINEAR = {"elastic": {"k_b": 4.75e8}, "viscous": {"c_b": 6e6}}


@pytest.fixture
def asking(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """An engineer's client; the paper's building has had two earthquakes."""
    (tmp_path / "records").mkdir()
    watched.watch(sessions, tmp_path / "records", watched.earthquakes()[1:3])
    with client(database_url) as made:
        yield made


def test_a_linear_model_lacks_hysteresis(asking: TestClient, sessions: sessionmaker[Session]) -> None:
    model = made(asking, LINEAR)
    job = done(asking, sessions, f"/api/v1/models/{model}/diagnoses", {"events": [2], "hold_out": [1]})
    assert (job["kind"], job["progress"]["stages"]) == ("diagnose", 3)
    found: dict[str, Any] = asking.get(f"/api/v1/diagnoses/{job['result']['diagnosis']}").json()
    assert (found["model"], found["job"], found["author"]) == (model, job["id"], "loopback")
    assert (found["fitted"], found["left_out"], found["analyses"]) == ([2], [1], [1, 2])
    assert {one["effect"] for one in found["candidates"]} == set(EFFECTS) - set(LINEAR)
    assert "bouc_wen" in found["set"]
    hysteretic = next(one for one in found["candidates"] if one["effect"] == "bouc_wen")
    assert hysteretic["delta_bic"] < -10
    assert hysteretic["error_after_held_out"] < 0.5 * hysteretic["error_before"]
    assert hysteretic["parameters"]["F_y"]["unit"] == "N"
    assert found["versions"][-1]["error_held_out"]["rms"] < found["versions"][1]["error_held_out"]["rms"]
    assert found["explanation"]
    (row,) = asking.get(f"/api/v1/models/{model}/diagnoses").json()["items"]
    assert row == {name: found[name] for name in row}
    assert asking.get(f"/api/v1/models/{model}").json()["effects"] == list(LINEAR)  # nothing is changed
    assert asking.get("/api/v1/models/99/diagnoses").status_code == 404
    assert asking.get("/api/v1/diagnoses/99").status_code == 404
