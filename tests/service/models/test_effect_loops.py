"""Loops of an effect at values that a person moves."""

import json
from collections.abc import Iterator

import numpy as np
import pytest
from api_client import client
from fastapi.testclient import TestClient

from core.effects import EFFECTS
from core.units import shown
from service.errors import FieldsError
from service.models.effect_loops import (
    ALONE,
    AMPLITUDE,
    LARGEST,
    WITH,
    WITHOUT,
    loops,
    read_values,
    slider,
    usual_values,
)

pytestmark = pytest.mark.sqlite


@pytest.fixture
def api(database_url: str) -> Iterator[TestClient]:
    with client(database_url) as made:
        yield made


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_has_loops_and_none_where_it_is_absent(name: str) -> None:
    found = loops(name, usual_values(name), AMPLITUDE)
    assert all(np.isfinite(force).all() for _, force in found.values())
    absent = loops(name, usual_values(name) | dict(EFFECTS[name].absent), AMPLITUDE)
    assert absent[WITH][1] == pytest.approx(absent[WITHOUT][1], rel=1e-6, abs=1.0)  # steps may differ
    assert (ALONE in found) == (EFFECTS[name].acts_on in ("force", "inertance"))


@pytest.mark.parametrize("name", EFFECTS)
def test_the_ends_of_sliders_are_values_that_the_form_accepts(name: str) -> None:
    for end in (0, 1):
        typed = {one.name: f"{slider(one)[end]:.4g}" for one in EFFECTS[name].parameters}
        values, amplitude = read_values(name, typed | {"amplitude": f"{1e3 * LARGEST}"})
        assert amplitude == LARGEST
        for one in EFFECTS[name].parameters:
            assert shown(values[one.name], one.unit) == pytest.approx(float(typed[one.name]), rel=1e-3)


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ({"k3": "-1"}, "k3: this must be from 0 to 10000 kN/mm³"),
        ({"k5": "nan"}, "k5: this must be from 0 to 100 kN/mm⁵"),
        ({"k3": "stiff"}, "k3: this must be a number from 0 to 10000 kN/mm³"),
        ({"amplitude": "1e9"}, "amplitude: this must be from 1 to 1000 mm"),
    ],
)
def test_values_out_of_range_are_refused_with_the_range(typed: dict[str, str], said: str) -> None:
    with pytest.raises(FieldsError, match=said):
        read_values("hardening", typed)


def test_the_page_shows_the_loop_at_the_values_of_its_address(api: TestClient) -> None:
    usual, stiffer = (
        api.get(f"/charts/effect.json?name=hardening{query}").json() for query in ("", "&k3=0.05&amplitude=200")
    )
    largest = [max(row["force"] for rows in spec["datasets"].values() for row in rows) for spec in (usual, stiffer)]
    assert largest[1] > 5 * largest[0]
    page = api.get("/effects/hardening?k3=0.05&amplitude=200").text
    assert 'name="k3" inputmode="decimal" value="0.05"' in page
    assert "k3=0.05" in page.split("data-chart=")[1].split(">")[0]
    refused = api.get("/effects/hardening?k3=-1")
    assert (refused.status_code, "This must be from 0 to 10000 kN/mm³" in refused.text) == (409, True)
    assert json.loads(api.get("/charts/effect.svg?name=hardening&k3=-1").text)["status"] == 409
    assert api.get("/charts/effect.svg?name=magic").status_code == 404
