"""People at a browser see a page with words and a way back; programs get a problem document."""

from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import httpx
import pytest
from asking import client
from monitoring import building_file

from service import buildings, migrate
from service import sessions as opened

BROWSER = {"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"}


@pytest.fixture
def asking(tmp_path: Path) -> Iterator[httpx.Client]:
    url = f"sqlite:///{tmp_path / 'menshin.sqlite'}"
    migrate.upgrade(url)
    sessions = opened.sessions(url)
    with sessions.begin() as session:
        buildings.add(session, building_file("folder", str(tmp_path)), tmp_path, datetime.now(UTC))
    sessions.kw["bind"].dispose()
    with client(url) as made:
        yield made


@pytest.mark.parametrize(
    ("method", "path", "status", "words"),
    [
        ("GET", "/events/999", 404, "There is no event"),
        ("GET", "/events/x", 404, "There is nothing at this address"),
        ("GET", "/nowhere", 404, "There is nothing at this address"),
        ("GET", "/buildings/NONE/events", 404, "There is no building"),
        ("GET", "/?building=%3Cx%3E", 422, "this is not in the form that is needed"),
        ("DELETE", "/events/1", 405, "cannot be used in that way"),
    ],
)
def test_an_error_is_a_page_to_a_browser_and_a_document_to_a_program(
    asking: httpx.Client, method: str, path: str, status: int, words: str
) -> None:
    shown = asking.request(method, path, headers=BROWSER)
    assert shown.status_code == status
    assert shown.headers["content-type"].startswith("text/html")
    assert words in shown.text.replace("&#39;", "'")
    assert '<a href="/">To the buildings</a>' in shown.text
    assert "pattern" not in shown.text
    assert "[A-Za-z" not in shown.text
    plain = asking.request(method, path)
    assert (plain.status_code, plain.headers["content-type"]) == (status, "application/problem+json")


def test_the_api_keeps_its_documents_for_browsers_too(asking: httpx.Client) -> None:
    answer = asking.get("/api/v1/events/999", headers=BROWSER)
    assert answer.headers["content-type"] == "application/problem+json"


def test_alerts_without_a_building_lead_to_the_buildings(asking: httpx.Client) -> None:
    answer = asking.get("/alerts", headers=BROWSER, follow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (303, "/")


def test_a_form_that_is_refused_says_so_without_an_expression(asking: httpx.Client) -> None:
    form = {"name": "me", "kind": "email", "address": "not an address"}
    answer = asking.post("/buildings/TOWER/receivers", data=form, headers=BROWSER)
    assert answer.status_code in (409, 422)
    assert answer.headers["content-type"].startswith("text/html")
    assert "pattern" not in answer.text


def test_the_page_of_the_messages_says_that_no_mail_can_be_sent(asking: httpx.Client) -> None:
    assert "No mail can be sent" in asking.get("/buildings/TOWER/messages").text
