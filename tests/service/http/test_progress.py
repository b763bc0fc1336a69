"""Forms keep what a person ticked while work goes on, and streams of progress end when they have to."""

import re
import socket
from collections.abc import Iterator
from datetime import UTC, datetime
from threading import Event as Signal, Thread
from time import monotonic

import databases
import httpx
import monitored_building
import pytest
from api_client import VISITOR, client
from api_server import api_server
from browsers import needs_chromium
from fastapi.testclient import TestClient
from model_jobs import MODELS, work, work_with_progress
from sqlalchemy import delete, select
from sqlalchemy.orm import Session, sessionmaker
from system_chromium import chromium

from service import serving as running
from service.access import keys
from service.access.auth import Caller, Role
from service.db import sessions as opened
from service.http.guard import LOOK
from service.http.rendering import FOLDER
from service.http.server import GRACE
from service.jobs.queue import MOST_REQUESTED
from service.jobs.tables import Job
from service.settings import Settings

NOW = datetime(2024, 1, 1, tzinfo=UTC)
LINEAR = {"elastic": {"k_b": 4.75e8}, "viscous": {"c_b": 6e6}}
SEEN = """() => {
    const work = document.querySelector("#work");
    window.seen = [];
    const options = {subtree: true, childList: true, characterData: true, attributes: true};
    new MutationObserver(() => seen.push(work.innerText)).observe(work, options);
}"""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The paper's building after two earthquakes, with a model that was not compared; no key before the last test."""
    folder = tmp_path_factory.mktemp("progress")
    made = databases.sqlite(folder)
    (folder / "records").mkdir()
    monitored_building.watch(opened.sessions(made), folder / "records", monitored_building.earthquakes()[:2])
    with client(made) as api:
        assert api.post(MODELS, json={"direction": "x", "effects": LINEAR}).json()["id"] == 1
    return made


@pytest.fixture
def sessions(url: str) -> Iterator[sessionmaker[Session]]:
    made = opened.sessions(url)
    yield made
    made.kw["bind"].dispose()


@pytest.fixture
def api(url: str) -> Iterator[TestClient]:
    with client(url) as made:
        yield made


def test_no_page_reloads_by_itself() -> None:
    pages = list((FOLDER / "templates").glob("*.html"))
    assert len(pages) > 10
    reloading = re.compile(r'http-equiv="refresh"(?![^>]*; url=)', re.IGNORECASE)  # with an address it leads on
    assert [page.name for page in pages if reloading.search(page.read_text())] == []


@needs_chromium
def test_a_ticked_box_survives_the_job_and_its_event_is_held_out(url: str, sessions: sessionmaker[Session]) -> None:
    with api_server(url) as address, chromium() as browser:
        page = browser.new_page()
        printed: list[str] = []
        page.on("console", lambda message: printed.append(message.text))
        page.goto(f"{address}/models/1")
        with page.expect_navigation():
            page.get_by_role("button", name="Compare with every event").click()
        page.get_by_text("Events to hold out").click()
        page.locator("[name=hold_out_2]").check()
        assert page.get_by_text("The model has not been compared with any event yet").is_visible()
        assert page.locator("#work progress").is_visible()
        assert not page.get_by_text("is not kept").is_visible(), "nothing has to be loaded again"
        page.evaluate(SEEN)
        work_with_progress(sessions)
        page.locator("#work .state", has_text="done").wait_for()
        page.locator("#results figure").first.wait_for()
        assert page.locator("#comparisons tbody tr").count() == 2
        assert any("Reading" in one for one in page.evaluate("() => seen")), "the progress moved"
        assert page.locator("[name=hold_out_2]").is_checked()
        assert not page.locator("[name=hold_out_1]").is_checked()
        page.get_by_role("button", name="Fit", exact=True).click()
        page.locator("#work progress").wait_for()
    assert printed == [], "the browser refused something"
    with sessions() as session:
        fit = session.scalars(select(Job).where(Job.kind == "fit")).one()
        assert fit.arguments["hold_out"] == [2]
    work(sessions)
    with client(url) as api:
        made = api.get("/api/v1/models/2").json()
        assert (made["fitted_to"], made["held_out"]) == ([1], [2])


def test_a_refused_form_keeps_what_was_ticked(api: TestClient) -> None:
    both = {"hold_out_1": "on", "hold_out_2": "on", "effect": "friction"}
    for wish in ("fit", "diagnose", "extend"):
        answer = api.post(f"/models/1/{wish}", data=both)
        assert answer.status_code == 409
        assert 'role="alert"' in answer.text
        for number in (1, 2):
            assert f'name="hold_out_{number}" checked' in answer.text
        assert "<option selected>friction" in answer.text
    assert 'name="hold_out_1" checked' not in api.get("/models/1").text


@pytest.mark.parametrize("wish", ["accept", "compare"])
def test_a_button_without_fields_keeps_what_was_ticked(api: TestClient, wish: str) -> None:
    done = api.post(f"/models/1/{wish}", data={"offered": "1", "hold_out_2": "on"})
    assert (done.status_code, done.headers["location"]) == (303, "/models/1?hold_out=2")
    page = api.get(done.headers["location"]).text
    assert 'name="hold_out_2" checked' in page
    assert 'name="hold_out_1" checked' not in page
    assert api.post(f"/models/1/{wish}", data={"offered": "1"}).headers["location"] == "/models/1?hold_out="


def test_a_button_without_fields_that_is_refused_keeps_what_was_ticked(
    api: TestClient, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        session.execute(delete(Job).where(Job.state == "waiting"))
        session.add_all(job("loopback") for _ in range(MOST_REQUESTED))
    refused = api.post("/models/1/compare", data={"offered": "1", "hold_out_2": "on"})
    with sessions.begin() as session:
        session.execute(delete(Job).where(Job.state == "waiting"))
    assert refused.status_code == 429
    assert 'role="alert"' in refused.text
    assert 'name="hold_out_2" checked' in refused.text
    assert 'name="hold_out_1" checked' not in refused.text


def test_the_user_who_requested_a_job_can_cancel_it_on_the_page(api: TestClient, url: str) -> None:
    sessions = opened.sessions(url)
    with sessions.begin() as session:
        mine, of_another, of_menshin = job("loopback"), job("somebody"), job(None)
        session.add_all([mine, of_another, of_menshin])
        session.flush()
        numbers = [mine.id, of_another.id, of_menshin.id]
    page = api.get("/models/1").text
    assert [f'action="/jobs/{one}/cancel"' in page for one in numbers] == [True, True, False]
    with client(url, visitor=Caller("loopback", Role.engineer)) as engineer:
        page = engineer.get("/models/1").text
        assert [f'action="/jobs/{one}/cancel"' in page for one in numbers] == [True, False, False]
        assert engineer.post(f"/jobs/{of_another.id}/cancel").status_code == 403
        assert engineer.post(f"/jobs/{numbers[0]}/cancel").headers["location"] == "/models/1"
    with client(url, visitor=Caller("loopback", Role.viewer)) as viewer:
        assert "/cancel" not in viewer.get("/models/1").text
        assert viewer.post(f"/jobs/{numbers[1]}/cancel").status_code == 403
    foreign = api.post(f"/jobs/{numbers[1]}/cancel", headers={"Origin": "https://elsewhere.example"})
    assert foreign.status_code == 403
    with sessions() as session:
        assert [session.get_one(Job, one).state for one in numbers] == ["cancelled", "waiting", "waiting"]
    again = api.post(f"/jobs/{numbers[0]}/cancel")
    assert again.status_code == 409
    assert f"Job {numbers[0]} has ended already: cancelled." in again.text
    own = api.post(f"/jobs/{numbers[2]}/cancel")
    assert "Menshin itself needs" in own.text
    with sessions.begin() as session:
        session.execute(delete(Job).where(Job.state == "waiting"))
    sessions.kw["bind"].dispose()


def job(asked_by: str | None) -> Job:
    """A comparison that waits."""
    return Job(kind="compare", model_id=1, asked_by=asked_by, arguments={}, state="waiting", created_at=NOW)


def waiting(sessions: sessionmaker[Session]) -> str:
    """Path of the stream of a job that no worker has."""
    with sessions.begin() as session:
        job = Job(kind="compare", model_id=1, arguments={}, state="waiting", created_at=NOW)
        session.add(job)
        session.flush()
        return f"/api/v1/jobs/{job.id}/progress"


def test_a_stream_ends_with_the_service(url: str, sessions: sessionmaker[Session]) -> None:
    path, stop = waiting(sessions), Signal()
    door = socket.create_server(("127.0.0.1", 0))
    service = Thread(target=running.api, args=(Settings(database_url=url), stop, door, VISITOR))
    service.start()
    try:
        address = f"http://127.0.0.1:{door.getsockname()[1]}"
        with httpx.stream("GET", address + path, timeout=30.0) as answer:
            lines = answer.iter_lines()
            assert next(lines).startswith("data: ")
            stop.set()
            assert not [line for line in lines if line.startswith("data")], "it ends, and is not cut off"
    finally:
        stop.set()
        service.join(GRACE + 5)
    assert not service.is_alive()


def test_a_stream_ends_soon_after_its_key_was_revoked(url: str, sessions: sessionmaker[Session]) -> None:
    path = waiting(sessions)
    with sessions.begin() as session:
        key = keys.create(session, "who leaves", Role.viewer, NOW)
        keys.create(session, "who stays", Role.admin, NOW)
    with (
        api_server(url, visitor=None) as address,
        httpx.stream("GET", address + path, headers={"X-API-Key": key}, timeout=30.0) as answer,
    ):
        assert answer.status_code == 200
        lines = answer.iter_lines()
        assert next(lines).startswith("data: ")
        with sessions.begin() as session:
            keys.revoke(session, "who leaves", NOW)
        began = monotonic()
        assert not [line for line in lines if line.startswith("data")]
        assert monotonic() - began < LOOK + 10
