"""From an engineer's request to a sketch of the missing force, by the API and by the pages."""

import os
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from shutil import which

import accessible
import monitored_building
import pytest
from api_client import client
from api_server import api_server
from fastapi.testclient import TestClient
from few_effects import few_effects
from model_jobs import create_model, finished_job, work
from playwright.sync_api import sync_playwright
from sqlalchemy.orm import Session, sessionmaker

from core.effect import Effect
from core.effects import EFFECTS
from core.paper import ISOLATOR

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]

WITHOUT_YIELDING = {name: dict(values) for name, values in ISOLATOR.effects.items() if name != "bouc_wen"}


@pytest.fixture(autouse=True)
def own_library() -> Iterator[None]:
    """Only the effects of the building's model: a sketch compiles the laws of all with its own."""
    with few_effects():
        yield


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """An engineer's client; the paper's building, whose isolators yield, has had three earthquakes."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", monitored_building.earthquakes()[:3])
    with client(database_url, progress_patience=1) as api:
        yield api


def test_the_yielding_that_a_model_lacks_is_sketched_by_the_api(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    """The law runs, and no process keeps it."""
    before = dict(EFFECTS)
    address = f"/api/v1/models/{create_model(api, WITHOUT_YIELDING)}/sketches"
    done = finished_job(api, sessions, address, {"hold_out": [3], "name": "found_here"})["result"]["sketch"]
    law = done["proposal"]
    assert law["effect"] == "found_here"
    assert law["terms"] == ["plain slip"]
    assert min(law["taken"].values()) > 0.5
    assert set(law["parameters"]) == set(law["values"]["found_here"])
    names: dict[str, object] = {}
    exec(compile(law["source"], "found_here.py", "exec"), names)
    assert isinstance(names["EFFECT"], Effect)
    assert dict(EFFECTS) == before
    course = done["course"]
    assert {trace["left_out"] for trace in course["traces"]} == {False, True}
    loop = {(part["branch"], part["low"]): part for part in course["bins"]}
    sides = [(part, loop[-1, low]) for (branch, low), part in loop.items() if branch == 1 and (-1, low) in loop]
    apart = [to["mean"] - back["mean"] > 2 * (to["std"] + back["std"]) for to, back in sides]
    assert sum(apart) > len(apart) / 2, "the yielding opens a loop"
    assert loop[1, sides[-1][0]["low"]]["law"] == pytest.approx(sides[-1][0]["mean"], rel=0.3)


@pytest.mark.parametrize(
    ("wanted", "status", "reason"),
    [
        ({"name": "two words"}, 422, "pattern"),
        ({"name": "elastic"}, 409, "unused name"),
        ({"name": "lambda"}, 409, "unused name"),
        ({"hold_out": [1, 2, 3]}, 409, "held out"),
        ({"events": [99]}, 409, "99"),
    ],
)
def test_impossible_requests_are_refused_in_words(
    api: TestClient, wanted: dict[str, object], status: int, reason: str
) -> None:
    answer = api.post(f"/api/v1/models/{create_model(api, WITHOUT_YIELDING)}/sketches", json=wanted)
    assert (answer.status_code, reason in answer.text) == (status, True), answer.text


def test_the_pages_lead_from_a_button_to_the_file_of_an_effect(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    model = create_model(api, WITHOUT_YIELDING)
    assert f'formaction="/models/{model}/sketch"' in api.get(f"/models/{model}").text
    sent = api.post(f"/models/{model}/sketch", data={"follow": "1", "hold_out_3": "on"}, follow_redirects=False)
    assert sent.status_code == 303
    work(sessions)
    shown = api.get(sent.headers["location"], follow_redirects=True)
    number = str(shown.url).rpartition("/sketches/")[2]
    text = unescape(shown.text)
    for words in ("The missing force", "yield variable", "force = force_1 · ", "all held out", "Download the effect"):
        assert words in text
    for kind in ("force", "law", "versions"):
        assert f"/charts/sketch-{kind}.svg?job={number}" in text
        assert "<svg" in api.get(f"/charts/sketch-{kind}.svg", params={"job": number}).text
        assert len(api.get(f"/charts/sketch-{kind}.csv", params={"job": number}).text.splitlines()) > 2
    file = api.get(f"/sketches/{number}/effect", params={"name": "our_wall"})
    assert file.headers["content-disposition"] == 'attachment; filename="our_wall.py"'
    assert "EFFECT = Effect(" in file.text
    for name in ("elastic", "no name", "None"):
        wrong = api.get(f"/sketches/{number}/effect", params={"name": name})
        assert wrong.status_code == 409
        assert f"An effect cannot be called '{name}'" in unescape(wrong.text)
    assert f'href="/sketches/{number}"' in api.get(f"/models/{model}").text
    other = finished_job(api, sessions, f"/api/v1/models/{model}/comparisons", {})["id"]
    for path in (f"/sketches/{other}", f"/sketches/{other}/effect", f"/charts/sketch-force.svg?job={other}"):
        assert api.get(path).status_code == 404


@pytest.mark.skipif(which("chromium") is None, reason="no Chromium to look at it with")
def test_a_sketch_is_accessible_in_both_languages(
    api: TestClient, database_url: str, sessions: sessionmaker[Session]
) -> None:
    model = create_model(api, WITHOUT_YIELDING)
    job = finished_job(api, sessions, f"/api/v1/models/{model}/sketches", {"hold_out": [3]})
    with api_server(database_url) as address, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=which("chromium"))
        for locale, heading in (("en", "sketch of the force"), ("ja", "欠けている力")):
            page = browser.new_context(locale=locale, viewport={"width": 1280, "height": 900}).new_page()
            page.goto(f"{address}/sketches/{job['id']}", wait_until="networkidle")
            words = page.inner_text("main")
            assert heading in words
            if locale == "ja":
                assert not [word for word in ("slip", "displacement", "Proposed", "held out") if word in words]
            if shots := os.environ.get("SHOTS"):
                for theme, width in (("light", 1280), ("dark", 375)):
                    page.evaluate("theme => { document.documentElement.dataset.theme = theme; }", theme)
                    page.set_viewport_size({"width": width, "height": 900})
                    page.wait_for_timeout(300)
                    page.screenshot(path=f"{shots}/{locale}-{theme}-{width}.png", full_page=True)
            assert accessible.problems(page) == []
        browser.close()
