"""By how much one more sensor would help: by the API and by the pages."""

import os
from collections.abc import Iterator
from html import unescape
from pathlib import Path

import accessible
import monitored_building
import pytest
from api_client import client
from api_server import api_server
from browsers import needs_chromium
from fastapi.testclient import TestClient
from model_jobs import finished_job, work
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]

ADDRESS = "/api/v1/buildings/PAPER/added-sensors"


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """An engineer's client; the paper's building has had two earthquakes."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", monitored_building.earthquakes()[:2])
    with client(database_url, progress_patience=1) as api:
        yield api


def test_the_api_computes_what_each_level_would_narrow(api: TestClient, sessions: sessionmaker[Session]) -> None:
    job = finished_job(api, sessions, ADDRESS, {"events": [1]})
    found = job["result"]["sensors"]
    assert (job["building_id"], job["arguments"], found["building"]) == (1, {"events": [1]}, "PAPER")
    (today,) = found["today"]
    assert today["records"] == 1
    ratios = [one["force_ratio"] for one in found["sensors"]]
    assert ratios == sorted(ratios)
    assert 0 < ratios[0] < ratios[-1] <= 1
    for one in found["sensors"]:
        assert one["force"] == pytest.approx(one["force_ratio"] * today["force"])
    best = next(one["level"] for one in found["sensors"])
    assert any(f"at {best} would make it" in sentence for sentence in found["sentences"])


def test_impossible_requests_are_refused_in_words(api: TestClient) -> None:
    for address, wanted, status, reason in (
        (ADDRESS, {"events": [99]}, 409, "no analysed earthquake 99"),
        (ADDRESS, {"events": [True]}, 422, "events"),
        (ADDRESS, {"levels": ["roof"]}, 422, "levels"),
        (ADDRESS.replace("PAPER", "NONE"), {}, 404, "NONE"),
    ):
        answer = api.post(address, json=wanted)
        assert (answer.status_code, reason in answer.text) == (status, True), answer.text


def test_a_building_without_earthquakes_is_told_so(
    database_url: str, sessions: sessionmaker[Session], tmp_path: Path
) -> None:
    monitored_building.watch(sessions, tmp_path, [])
    with client(database_url) as api:
        assert api.post(ADDRESS, json={}).status_code == 409
        refused = api.post("/buildings/PAPER/added-sensors")
        assert (refused.status_code, "has no analysed earthquake" in refused.text) == (409, True)


def test_the_page_of_the_building_leads_to_the_result(api: TestClient, sessions: sessionmaker[Session]) -> None:
    assert 'action="/buildings/PAPER/added-sensors"' in api.get("/buildings/PAPER").text
    sent = api.post("/buildings/PAPER/added-sensors")
    assert sent.status_code == 303
    waiting = api.get(sent.headers["location"]).text
    assert "benefit of one more sensor" in waiting
    work(sessions)
    shown = api.get(sent.headers["location"], follow_redirects=True)
    number = shown.url.path.removeprefix("/sensors/")
    words = unescape(shown.text)
    for part in ("would make it", "by 2 records", "as today", "Assumed:", "Force (kN)"):
        assert part in words
    chart = {"job": number, "direction": "x"}
    assert "<svg" in api.get("/charts/added-sensors.svg", params=chart).text
    table = api.get("/charts/added-sensors.csv", params=chart).text.splitlines()
    assert len(table) == 1 + words.count('<tr class="number"><td>') - 1, "one line for each level"
    assert f'href="/sensors/{number}"' in api.get("/buildings/PAPER").text
    assert api.get("/charts/added-sensors.svg", params=chart | {"direction": "y"}).status_code == 404
    assert api.get("/sensors/1").status_code == 404, "the first job analysed an earthquake"


def test_who_requested_it_cancels_it(api: TestClient) -> None:
    sent = api.post("/buildings/PAPER/added-sensors")
    stopped = api.post(f"{sent.headers['location']}/cancel")
    assert (stopped.status_code, stopped.headers["location"]) == (303, "/buildings/PAPER")


@needs_chromium
def test_the_page_is_accessible_in_both_languages(
    api: TestClient, database_url: str, sessions: sessionmaker[Session]
) -> None:
    job = finished_job(api, sessions, ADDRESS, {})["id"]
    with api_server(database_url) as address, chromium() as browser:
        for locale, heading in (("en", "one more accelerometer"), ("ja", "加速度計を1台追加")):
            page = browser.new_context(locale=locale, viewport={"width": 1280, "height": 900}).new_page()
            page.goto(f"{address}/sensors/{job}", wait_until="networkidle")
            words = page.inner_text("main")
            assert heading in words
            if locale == "ja":
                assert not [word for word in ("accelerometer", "record", "today", "Direction") if word in words]
            if shots := os.environ.get("SHOTS"):
                for theme, width in (("light", 1280), ("dark", 375)):
                    page.evaluate("theme => { document.documentElement.dataset.theme = theme; }", theme)
                    page.set_viewport_size({"width": width, "height": 900})
                    page.wait_for_timeout(300)
                    page.screenshot(path=f"{shots}/{locale}-sensors-{theme}-{width}.png", full_page=True)
            assert accessible.problems(page) == []
