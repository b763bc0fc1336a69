"""From an engineer's request to a forecast, by the API and by the pages."""

import os
import re
from collections.abc import Iterator, Sequence
from html import unescape
from math import exp, sin
from pathlib import Path
from typing import Any

import monitored_building
import pytest
from api_client import client
from api_server import api_server
from browsers import needs_chromium
from fastapi.testclient import TestClient
from model_jobs import create_model, finished_job, work
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from core.paper import ISOLATOR
from service.http.guard import UPLOAD

pytestmark = [pytest.mark.slow, pytest.mark.sqlite]

TRUTH = {name: dict(values) for name, values in ISOLATOR.effects.items()}


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session], tmp_path: Path) -> Iterator[TestClient]:
    """An engineer's client; the paper's building has had two earthquakes."""
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", monitored_building.earthquakes()[:2])
    with client(database_url, progress_patience=1) as api:
        yield api


def test_a_stored_earthquake_comes_again(api: TestClient, sessions: sessionmaker[Session]) -> None:
    """As it was, it moves the isolators as recorded; stronger, farther, and out of range by far."""
    model = create_model(api, TRUTH)
    address = f"/api/v1/models/{model}/forecasts"
    recorded = api.get("/api/v1/events/1").json()
    (one,) = finished_job(api, sessions, address, {"earthquake": 1})["result"]["forecast"]["forecasts"]
    moved = next(peak for peak in one["peaks"] if peak["quantity"] == "displacement")
    measured = abs(recorded["directions"][0]["peak_displacement"]) if "directions" in recorded else None
    assert moved["low"] < moved["value"] < moved["high"]
    assert measured is None or moved["low"] < measured < moved["high"]
    assert one["factor"] == 1
    assert not one["out_of_range"]
    (strong,) = finished_job(api, sessions, address, {"earthquake": 1, "pga": 20.0})["result"]["forecast"]["forecasts"]
    assert strong["pga"] == pytest.approx(20.0)
    assert strong["out_of_range"]
    assert not [
        limit for limit in strong["limits"] if limit["outcome"] == "passed" and limit["check"] == "shear_strain"
    ]
    (wished,) = finished_job(api, sessions, address, {"earthquake": 2, "displacement": 0.02})["result"]["forecast"][
        "forecasts"
    ]
    assert next(peak for peak in wished["peaks"] if peak["quantity"] == "displacement")["value"] == pytest.approx(
        0.02, rel=1e-3
    )


@pytest.mark.parametrize(
    ("wanted", "status", "reason"),
    [
        ({"earthquake": 99}, 404, "99"),
        ({"earthquake": 1, "pga": 1.0, "displacement": 0.1}, 409, "scale to one thing"),
        ({"earthquake": 1, "pga": -1.0}, 422, "greater than 0"),
        ({"earthquake": 1, "pga": 1e6}, 422, "less than or equal to 100"),
        ({"earthquake": 1, "pga": "strong"}, 422, "number"),
        ({"earthquake": 1, "temperature": 1000.0}, 422, "less than or equal to 100"),
        ({"earthquake": 1, "design_spectrum": True}, 409, "no [design_spectrum]"),
        ({}, 422, "earthquake"),
    ],
)
def test_impossible_requests_are_refused_in_words(
    api: TestClient, wanted: dict[str, object], status: int, reason: str
) -> None:
    answer = api.post(f"/api/v1/models/{create_model(api, TRUTH)}/forecasts", json=wanted)
    assert (answer.status_code, reason in answer.text) == (status, True), answer.text


def test_the_pages_lead_from_a_form_to_a_forecast(api: TestClient, sessions: sessionmaker[Session]) -> None:
    model = create_model(api, TRUTH)
    page = api.get(f"/models/{model}").text
    assert "If this earthquake came today" in page
    fields = {"earthquake": "1", "scaling": "displacement", "size": "40 gal"}
    wrong = api.post(f"/models/{model}/forecast", data=fields)
    assert wrong.status_code in (409, 422)
    assert "has the unit of acceleration; give displacement" in unescape(wrong.text)
    assert 'value="40 gal"' in wrong.text
    sent = api.post(f"/models/{model}/forecast", data=fields | {"size": "80"}, follow_redirects=False)
    assert sent.status_code == 303
    job = sent.headers["location"]
    work(sessions)
    shown = api.get(job, follow_redirects=True)
    assert shown.status_code == 200
    assert re.fullmatch(r".*/forecasts/\d+", str(shown.url))
    text = unescape(shown.text)
    assert re.search(r"displacement of the isolators<td>x<td>80 mm<td>\d+ – \d+ mm", text)
    for words in ("Limits of the building", "Shear strain of the isolators", "out of range"):
        assert words in text
    for picture in re.findall(r'src="(/charts/[^"]+)"', text):
        drawn = api.get(picture).text
        assert "<svg" in drawn
        assert "(mm)" in drawn or "(m/s²)" in drawn
    for kind in ("displacement", "accelerations"):
        lines = api.get(f"/charts/forecast-{kind}.csv", params={"job": job.rpartition("/")[2]}).text
        assert len(lines.splitlines()) > 5
    assert f'href="/forecasts/{job.rpartition("/")[2]}"' in api.get(f"/models/{model}").text
    assert api.get("/forecasts/99").status_code == 404


def csv(direction: str, values: Sequence[float]) -> bytes:
    """A file of one component from elsewhere, gal."""
    lines = ["# start: 2024-01-01T00:00:00Z", "# rate: 100", f"YY.ELSE.00.HN{direction} [gal]", *map(repr, values)]
    return "\n".join(lines).encode()


def pulse(size: float) -> list[float]:
    return [size * sin(0.05 * n) * exp(-(((n - 1000) / 300) ** 2)) for n in range(2000)]


def test_an_uploaded_record_moves_the_isolators_as_the_stored_earthquake_does(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    address = f"/api/v1/models/{create_model(api, TRUTH)}/forecasts"
    (stored,) = finished_job(api, sessions, address, {"earthquake": 1})["result"]["forecast"]["forecasts"]
    sent = api.post(
        f"{address}/uploaded", content=monitored_building.earthquakes()[0], headers={"X-File-Name": "first.mseed"}
    )
    assert sent.status_code == 202, sent.text
    assert sent.json()["arguments"]["motion"]["name"] == "first.mseed"
    work(sessions)
    (found,) = api.get(sent.headers["location"]).json()["result"]["forecast"]["forecasts"]
    assert found["motion"] == "first"
    assert found["pga"] == pytest.approx(stored["pga"], rel=0.05)
    for one, other in zip(found["peaks"], stored["peaks"], strict=True):
        assert (one["quantity"], one["level"]) == (other["quantity"], other["level"])
        assert one["value"] == pytest.approx(other["value"], rel=0.05), one


def test_components_in_files_of_their_own_are_one_motion_by_the_page(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    """Names of files may have any letters."""
    model = create_model(api, TRUTH)
    assert 'type="file"' in api.get(f"/models/{model}").text
    files = [("motion", (f"記録 {name}.csv", csv(name, pulse(size)))) for name, size in (("E", 200.0), ("N", 100.0))]
    sent = api.post(f"/models/{model}/forecast", data={"scaling": "pga", "size": "300"}, files=files)
    assert sent.status_code == 303, sent.text
    work(sessions)
    shown = unescape(api.get(sent.headers["location"], follow_redirects=True).text)
    assert "記録 E" in shown
    assert "300 gal" in shown


@pytest.mark.parametrize(
    ("content", "query", "status", "reason"),
    [
        (b"no record", {}, 409, "motion"),
        (csv("E", [1.0, 2.0]).replace(b"[gal]", b"[mm]"), {}, 409, "it has no acceleration"),
        (csv("Q", pulse(1.0)), {}, 409, "the direction of YY.ELSE.00.HNQ is not known"),
        (csv("E", pulse(1.0)), {"pga": 1.0, "displacement": 0.1}, 409, "scale to one thing"),
        (csv("E", pulse(1.0)), {"design_spectrum": True}, 409, "no [design_spectrum]"),
        (csv("E", pulse(1.0)), {"pga": -1.0}, 422, "greater than 0"),
        (b"x" * (UPLOAD + 1), {}, 413, str(UPLOAD)),
    ],
)
def test_files_that_cannot_be_used_are_refused_in_words(
    api: TestClient, content: bytes, query: dict[str, Any], status: int, reason: str
) -> None:
    address = f"/api/v1/models/{create_model(api, TRUTH)}/forecasts/uploaded"
    answer = api.post(address, params=query, content=content)
    assert (answer.status_code, reason in answer.text) == (status, True), answer.text


def test_the_page_says_why_a_file_or_a_missing_one_is_refused(api: TestClient) -> None:
    address = f"/models/{create_model(api, TRUTH)}/forecast"
    wrong = api.post(address, data={"scaling": "none"}, files=[("motion", ("a.csv", b"no record"))])
    assert (wrong.status_code, "a.csv" in wrong.text) == (409, True)
    none = api.post(address, data={"scaling": "none"}, files=[("motion", ("", b""))])
    assert "Choose an earthquake, or a file of a ground motion" in unescape(none.text)
    many = api.post(address, data={"scaling": "none"}, files=[("motion", (f"{n}.csv", b"1")) for n in range(13)])
    assert "at most 12 files" in many.text


@needs_chromium
def test_a_forecast_fits_a_telephone_in_both_languages(
    api: TestClient, database_url: str, sessions: sessionmaker[Session]
) -> None:
    model = create_model(api, TRUTH)
    job = finished_job(api, sessions, f"/api/v1/models/{model}/forecasts", {"earthquake": 1, "pga": 20.0})
    english = "today", "Limits of the building", "OUT OF RANGE"
    with api_server(database_url) as address, chromium() as browser:
        for locale, width in (("en", 320), ("ja", 320), ("ja", 1280)):
            page = browser.new_context(
                locale=locale, viewport={"width": width, "height": 900}, java_script_enabled=False, color_scheme="dark"
            ).new_page()
            for path in (f"/forecasts/{job['id']}", f"/models/{model}"):
                page.goto(f"{address}{path}")
                assert page.locator("html").evaluate("one => one.scrollWidth") <= width, (locale, path)
                assert ("今日" if locale == "ja" else english[0]) in page.inner_text("main")
                if locale == "ja":
                    assert not [word for word in english if word in page.inner_text("main")]
                if shots := os.environ.get("SHOTS"):
                    page.screenshot(path=f"{shots}/{locale}-{width}-{path.split('/')[1]}.png", full_page=True)


def test_another_jobs_number_is_no_forecast(api: TestClient, sessions: sessionmaker[Session]) -> None:
    job = finished_job(api, sessions, f"/api/v1/models/{create_model(api, TRUTH)}/comparisons", {})
    assert api.get(f"/forecasts/{job['id']}").status_code == 404
    assert api.get("/charts/forecast-displacement.svg", params={"job": job["id"]}).status_code == 404
