"""From an engineer's request to a sketch of the missing force, by the API and by the pages."""

import os
import pickle
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from html import unescape
from pathlib import Path
from types import MappingProxyType
from typing import Any

import accessible
import monitored_building
import paper_records
import pytest
from api_client import client
from api_server import api_server
from browsers import needs_chromium
from fastapi.testclient import TestClient
from few_effects import LINEAR_WITH_YIELDING, few_effects
from model_jobs import create_model, finished_job, work
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from core.effect import Effect
from core.effects import EFFECTS
from core.paper import ISOLATOR
from service.access import keys as access_keys
from service.access.roles import Role
from service.buildings import store as building_store
from service.jobs.queue import DIAGNOSE, EXTEND, FIT, Claim
from service.jobs.stages import Kind, Stage, silent
from service.jobs.tables import Job
from service.models.kept_effects import knowing
from service.models.tables import KeptEffect

KEPT = "/api/v1/kept-effects"
pytestmark = [pytest.mark.slow, pytest.mark.sqlite]

WANTED: Mapping[str, object] = MappingProxyType({"hold_out": [3], "name": "our_wall"})
"""One sketch for most tests; its law is compiled once if it is kept by that name."""
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
    done = finished_job(api, sessions, address, dict(WANTED))["result"]["sketch"]
    law = done["proposal"]
    assert law["effect"] == "our_wall"
    assert law["terms"] == ["plain slip"]
    assert min(law["taken"].values()) > 0.5
    assert set(law["parameters"]) == set(law["values"]["our_wall"])
    names: dict[str, object] = {}
    exec(compile(law["source"], "our_wall.py", "exec"), names)
    assert isinstance(names["EFFECT"], Effect)
    assert dict(EFFECTS) == before
    course = done["course"]
    assert {trace["held_out"] for trace in course["traces"]} == {False, True}
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
    for name in ("elastic", "no name", "None", "1bad"):
        wrong = api.get(f"/sketches/{number}/effect", params={"name": name})
        assert wrong.status_code == 409
        assert f"An effect cannot be called '{name}'" in unescape(wrong.text)
        assert "no digit first" in wrong.text
    assert f'href="/sketches/{number}"' in api.get(f"/models/{model}").text
    other = finished_job(api, sessions, f"/api/v1/models/{model}/comparisons", {})["id"]
    for path in (f"/sketches/{other}", f"/sketches/{other}/effect", f"/charts/sketch-force.svg?job={other}"):
        assert api.get(path).status_code == 404


@pytest.fixture
def sketch(api: TestClient, sessions: sessionmaker[Session]) -> int:
    """Number of a sketch's job."""
    address = f"/api/v1/models/{create_model(api, WITHOUT_YIELDING)}/sketches"
    number: int = finished_job(api, sessions, address, dict(WANTED))["id"]
    return number


def kept(api: TestClient, sketch: int, name: str) -> Any:  # noqa: ANN401  JSON
    answer = api.post(KEPT, json={"sketch": sketch, "name": name})
    assert answer.status_code == 201, answer.text
    return answer.json()


def test_a_law_is_kept_as_an_effect_of_every_model(
    api: TestClient, sessions: sessionmaker[Session], sketch: int
) -> None:
    """The next job knows it, in whichever process or thread it runs; none of them keeps it."""
    before = dict(EFFECTS)
    made = kept(api, sketch, "our_wall")
    assert (made["sketch"], made["building"], made["author"]) == (sketch, "PAPER", "loopback")
    proposal = api.get(f"/api/v1/jobs/{sketch}").json()["result"]["sketch"]["proposal"]
    assert made["formula"] == proposal["formula"]
    assert api.get(KEPT).json()["items"] == [made]
    assert api.get(KEPT, params={"format": "csv"}).text.splitlines()[0].startswith("name,formula")
    assert "our_wall" in [one["name"] for one in api.get("/api/v1/effects").json()["items"]]
    shown = api.get("/api/v1/effects/our_wall").json()
    assert (shown["title"], shown["family"]) == ("Sketch: plain slip", "sketched")
    file = api.get(f"{KEPT}/our_wall/file")
    assert file.headers["content-disposition"] == 'attachment; filename="our_wall.py"'
    assert file.text == proposal["source"]

    model = create_model(api, WITHOUT_YIELDING)
    assert "<option>our_wall</option>" in api.get(f"/models/{model}").text
    done = finished_job(api, sessions, f"/api/v1/models/{model}/effects", {"effect": "our_wall", "hold_out": [3]})
    wider = api.get(f"/api/v1/models/{done['result']['made']}").json()
    assert {one["effect"] for one in wider["values"]} == {*WITHOUT_YIELDING, "our_wall"}
    assert "[effects.our_wall]" in api.get(f"/api/v1/models/{wider['id']}/file").text
    assert dict(EFFECTS) == before

    used = api.delete(f"{KEPT}/our_wall")
    assert (used.status_code, str(wider["id"]) in used.text) == (409, True), used.text


@pytest.mark.parametrize(
    ("kind", "arguments", "there"),
    [
        (DIAGNOSE, {}, {*LINEAR_WITH_YIELDING, "our_wall"}),
        (FIT, {}, set(LINEAR_WITH_YIELDING)),
        (EXTEND, {"effect": "our_wall"}, {*WITHOUT_YIELDING, "our_wall"}),
    ],
)
def test_each_kind_of_work_has_the_effects_that_it_needs(
    api: TestClient,
    sessions: sessionmaker[Session],
    sketch: int,
    kind: str,
    arguments: dict[str, str],
    there: set[str],
) -> None:
    """A diagnosis tries what was kept; other work compiles no law that its model does not have."""
    kept(api, sketch, "our_wall")
    stage = Stage("listing", sorted, lambda done, report_step: (EFFECTS,))
    work = knowing(Kind(lambda session, claim, settings: None, lambda inputs: (stage,), lambda *stored: None))
    claim = Claim(1, kind, None, create_model(api, WITHOUT_YIELDING), None, arguments, 1, 0)
    with sessions() as session:
        (known,) = work.stages(work.inputs(session, claim, monitored_building.SETTINGS))
    function = pickle.loads(pickle.dumps(known.function))
    with ThreadPoolExecutor(1) as pool:
        assert set(pool.submit(function, *known.arguments((), silent)).result()) == there
        assert "our_wall" not in pool.submit(sorted, EFFECTS).result()


def test_work_that_may_give_an_effect_to_a_model_keeps_it(api: TestClient, sketch: int) -> None:
    for name in ("our_wall", "our_brace"):
        kept(api, sketch, name)
    address = f"/api/v1/models/{create_model(api, WITHOUT_YIELDING)}/effects"
    job = api.post(address, json={"effect": "our_wall", "hold_out": [3]}).json()["id"]
    wanted = api.delete(f"{KEPT}/our_wall")
    assert (wanted.status_code, f"Job {job} may give" in wanted.text) == (409, True)
    assert api.delete(f"{KEPT}/our_brace").status_code == 204
    assert [one["name"] for one in api.get(KEPT).json()["items"]] == ["our_wall"]
    assert api.get("/api/v1/effects/our_brace").status_code == 404


def test_what_cannot_be_kept_is_refused(api: TestClient, sketch: int) -> None:
    """Names of the library, of what is kept already, and of nothing; code, which no request can bring."""
    kept(api, sketch, "our_wall")
    for wanted, status, reason in (
        ({"name": "elastic"}, 409, "unused name"),
        ({"name": "lambda"}, 409, "unused name"),
        ({"name": "our_wall"}, 409, "unused name"),
        ({"name": "two words"}, 422, "pattern"),
        ({"name": "x", "source": "import os"}, 422, "source"),
        ({"name": "x", "sketch": 99}, 404, "99"),
    ):
        answer = api.post(KEPT, json={"sketch": sketch, **wanted})
        assert (answer.status_code, reason in answer.text) == (status, True), answer.text


def test_a_sketch_without_a_law_as_values_cannot_be_kept(
    api: TestClient, sessions: sessionmaker[Session], sketch: int
) -> None:
    """As earlier versions stored it, or where nothing is proposed."""
    for change, reason in (({"law": None}, "sketch again"), (None, "proposes no law")):
        with sessions.begin() as session:
            job = session.get_one(Job, sketch)
            found = dict((job.result or {})["sketch"])
            found["proposal"] = None if change is None else found["proposal"] | change
            job.result = {"sketch": found}
        answer = api.post(KEPT, json={"sketch": sketch, "name": "our_wall"})
        assert (answer.status_code, reason in answer.text) == (409, True), answer.text


def test_a_law_of_a_later_version_is_listed_and_offered_to_no_model(
    api: TestClient, sessions: sessionmaker[Session], sketch: int
) -> None:
    kept(api, sketch, "our_wall")
    with sessions.begin() as session:
        row = session.scalars(select(KeptEffect)).one()
        row.law = row.law | {"terms": [{"term": "spring of another age", "own": 0.0, "amplitude": 1.0}]}
    assert api.get(KEPT).json()["items"][0]["formula"] is None
    assert api.get("/api/v1/effects/our_wall").status_code == 404
    assert api.get(f"{KEPT}/our_wall/file").status_code == 409


def test_the_pages_keep_show_and_delete_an_effect(api: TestClient, sketch: int) -> None:
    """By another name than it was sketched with."""
    assert f'formaction="/sketches/{sketch}/keep"' in api.get(f"/sketches/{sketch}").text
    for name, status, reason in (
        ("elastic", 409, "cannot be called 'elastic'"),
        ("no name", 409, "form that is needed"),
    ):
        wrong = api.post(f"/sketches/{sketch}/keep", data={"name": name})
        assert (wrong.status_code, reason in unescape(wrong.text)) == (status, True)
        assert f'value="{name}"' in wrong.text
    sent = api.post(f"/sketches/{sketch}/keep", data={"name": "our_brace"}, follow_redirects=False)
    assert (sent.status_code, sent.headers["location"]) == (303, "/effects/our_brace")
    shown = api.get("/effects/our_brace").text
    for part in (f'href="/sketches/{sketch}"', "by loopback", "Delete this effect", "A law sketched from records"):
        assert part in shown
    assert "<svg" in api.get("/charts/effect.svg", params={"name": "our_brace"}).text
    assert 'href="/effects/our_brace"' in api.get(f"/sketches/{sketch}").text
    assert 'href="/effects/our_brace"' in api.get("/effects").text
    gone = api.post("/effects/our_brace/delete", follow_redirects=False)
    assert (gone.status_code, gone.headers["location"]) == (303, "/effects")
    assert api.get("/effects/our_brace").status_code == 404


def test_an_engineer_of_some_buildings_cannot_delete_what_others_may_use(
    api: TestClient, database_url: str, sessions: sessionmaker[Session], sketch: int
) -> None:
    kept(api, sketch, "our_wall")
    with sessions.begin() as session:
        other = paper_records.building_file().replace('code = "PAPER"', 'code = "OTHER"')
        building_store.add(session, other, Path("/"), monitored_building.NOW)
        keys = {
            code: access_keys.create(session, code, Role.engineer, monitored_building.NOW, buildings=[code])
            for code in ("PAPER", "OTHER")
        }
    with client(database_url) as limited:
        for code, seen in (("PAPER", sketch), ("OTHER", None)):
            own = {"X-API-Key": keys[code]}
            assert limited.get(KEPT, headers=own).json()["items"][0]["sketch"] == seen
            assert limited.delete(f"{KEPT}/our_wall", headers=own).status_code == 403
            assert "Delete this effect" not in limited.get("/effects/our_wall", headers=own).text


@needs_chromium
def test_a_sketch_and_the_effect_made_of_it_are_accessible_in_both_languages(
    api: TestClient, database_url: str, sketch: int
) -> None:
    kept(api, sketch, "our_brace")
    english = ("slip", "displacement", "Proposed", "held out", "Kept", "Sketch")
    with api_server(database_url) as address, chromium() as browser:
        for locale, path, heading in (
            ("en", f"/sketches/{sketch}", "sketch of the force"),
            ("ja", f"/sketches/{sketch}", "欠けている力"),
            ("ja", "/effects/our_brace", "効果"),
        ):
            page = browser.new_context(locale=locale, viewport={"width": 1280, "height": 900}).new_page()
            page.goto(f"{address}{path}", wait_until="networkidle")
            words = page.inner_text("main")
            assert heading in words
            if locale == "ja":
                assert not [word for word in english if word in words.replace(page.inner_text("pre"), "")]
            if shots := os.environ.get("SHOTS"):
                for theme, width in (("light", 1280), ("dark", 375)):
                    page.evaluate("theme => { document.documentElement.dataset.theme = theme; }", theme)
                    page.set_viewport_size({"width": width, "height": 900})
                    page.wait_for_timeout(300)
                    page.screenshot(path=f"{shots}/{locale}-{path.split('/')[1]}-{theme}-{width}.png", full_page=True)
            assert accessible.problems(page) == []
