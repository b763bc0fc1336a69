"""`menshin status` on stored buildings: normal, beyond a limit, without an earthquake."""

import json
from pathlib import Path

import pytest
from api_client import client
from assessed_buildings import STRONG, add_comparison, building, building_file, day, earthquake
from command import menshin
from sqlalchemy.orm import Session, sessionmaker

from service.buildings import store as building_store
from service.buildings.tables import Building

pytestmark = pytest.mark.sqlite


@pytest.fixture(autouse=True)
def on_database(monkeypatch: pytest.MonkeyPatch, database_url: str) -> None:
    monkeypatch.delenv("MENSHIN_SETTINGS", raising=False)
    monkeypatch.setenv("MENSHIN_DATABASE_URL", database_url)
    monkeypatch.setenv("COLUMNS", "240")


def shaken(session: Session, displacement: float) -> Building:
    """A building whose last earthquake moved the isolators so far (m)."""
    made = building(session)
    add_comparison(session, earthquake(session, made, day(1), displacement))
    return made


def test_a_normal_building_ends_with_zero_and_shows_every_check(sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        code = shaken(session, 0.02).code
    every, one = menshin("status"), menshin("status", "--building", code)
    assert (every.exit_code, one.exit_code) == (0, 0), every.output + one.output
    assert f"{code}, a tower" in every.output
    assert "normal: 15 of 15 checks passed" in every.output
    assert "This does not replace an inspection." in every.output
    assert f"{day(1):%Y-%m-%d %H:%M}" in every.output
    assert one.output.count("passed") == 15 + len(["15 of 15 checks passed"]) * 2
    assert "JMA instrumental intensity (unofficial, ground, x, y, z)" in one.output
    assert "Menshin's default; inspect by JSSI: 5-lower" in one.output


def test_the_most_severe_building_comes_first_and_ends_with_one(
    sessions: sessionmaker[Session], database_url: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with sessions.begin() as session:
        normal, strong, silent = shaken(session, 0.02), shaken(session, STRONG), building(session, limits="")
        codes = [one.code for one in (strong, silent, normal)]
    done = menshin("status", "--json")
    assert done.exit_code == 1
    items = json.loads(done.output)["items"]
    assert [one["building"] for one in items] == codes
    assert [one["verdict"]["level"] for one in items] == ["inspect", "undecided", "normal"]
    with client(database_url) as api:
        for one in items:
            assert api.get(f"/api/v1/buildings/{one['building']}/verdict").json() == one["verdict"]
    assert menshin("status", "--building", codes[0]).exit_code == 1
    assert "Have the building inspected before normal use." in menshin("status").output
    unsettled = menshin("status", "--building", codes[1])
    assert unsettled.exit_code == 1
    assert "Give design_displacement under [isolation] in the building file." in unsettled.output
    monkeypatch.setenv("COLUMNS", "60")
    assert "…" not in menshin("status").output + menshin("status", "--building", codes[1]).output, "nothing is cut off"
    assert menshin("status", "--building", codes[2]).exit_code == 0


def test_without_a_building_or_an_earthquake_nothing_is_normal(sessions: sessionmaker[Session], tmp_path: Path) -> None:
    none = menshin("status")
    assert (none.exit_code, none.stdout) == (1, "")
    assert "No building is monitored" in none.stderr
    assert (menshin("status", "--json").exit_code, json.loads(menshin("status", "--json").stdout)) == (1, {"items": []})
    unknown = menshin("status", "--building", "NONE")
    assert (unknown.exit_code, unknown.stdout) == (1, "")
    assert "no building 'NONE'" in unknown.stderr
    with sessions.begin() as session:
        building_store.add(session, building_file("NEW"), tmp_path, day(0))
    unseen = menshin("status")
    assert unseen.exit_code == 1
    assert "no data: No earthquake has been recorded yet" in unseen.output
