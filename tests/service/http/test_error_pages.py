"""People at a browser see a page with words and a way back; programs get a problem document."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from html import unescape
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import databases
import httpx
import pytest
from alert_fixtures import raise_softening
from api_client import VISITOR, client
from fastapi.testclient import TestClient
from monitoring_server import building_file
from sqlalchemy import create_engine, text

from service.access.roles import Caller, Role
from service.app import create
from service.buildings import store as building_store
from service.db import sessions as opened
from service.settings import Settings

BROWSER = {"Accept": "text/html,application/xhtml+xml,*/*;q=0.8"}


@pytest.fixture
def url(tmp_path: Path) -> str:
    """Database of a building with an active alert."""
    url = databases.sqlite(tmp_path)
    sessions = opened.sessions(url)
    with sessions.begin() as session:
        made = building_store.add(session, building_file("folder", str(tmp_path)), tmp_path, datetime.now(UTC))
        raise_softening(session, made)
    sessions.kw["bind"].dispose()
    return url


@pytest.fixture
def api(url: str) -> Iterator[httpx.Client]:
    with client(url, smtp_host="localhost") as made:
        yield made


def spoil(url: str) -> None:
    """Let the evidence of the alerts be no JSON any more."""
    engine = create_engine(url)
    with engine.begin() as connection:
        connection.execute(text("UPDATE alert SET evidence = 'hunter2'"))
    engine.dispose()


@pytest.mark.parametrize(
    ("method", "path", "status", "words"),
    [
        ("GET", "/events/999", 404, "There is no event"),
        ("GET", "/events/x", 404, "There is nothing at this address"),
        ("GET", "/nowhere", 404, "There is nothing at this address"),
        ("GET", "/buildings/NONE/events", 404, "There is no building"),
        ("GET", "/?building=%3Cx%3E", 422, "this does not have the required form"),
        ("DELETE", "/events/1", 405, "cannot be used in that way"),
    ],
)
def test_an_error_is_a_page_to_a_browser_and_a_document_to_a_program(
    api: httpx.Client, method: str, path: str, status: int, words: str
) -> None:
    shown = api.request(method, path, headers=BROWSER)
    assert shown.status_code == status
    assert shown.headers["content-type"].startswith("text/html")
    assert words in shown.text.replace("&#39;", "'")
    assert '<a href="/">To the buildings</a>' in shown.text
    assert "pattern" not in shown.text
    assert "[A-Za-z" not in shown.text
    plain = api.request(method, path)
    assert (plain.status_code, plain.headers["content-type"]) == (status, "application/problem+json")


def test_the_api_keeps_its_documents_for_browsers_too(api: httpx.Client) -> None:
    answer = api.get("/api/v1/events/999", headers=BROWSER)
    assert answer.headers["content-type"] == "application/problem+json"


def test_alerts_without_a_building_lead_to_the_buildings(api: httpx.Client) -> None:
    answer = api.get("/alerts", headers=BROWSER, follow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (303, "/")


@dataclass(frozen=True)
class Sent:
    """A form as it is sent, and what is shown after it."""

    path: str
    typed: Mapping[str, str]
    """Fields that are sent and shown again."""
    wrong: str
    """Identity of the field that is marked."""
    words: str
    chosen: tuple[str, ...] = ()
    """HTML of choices that are shown again."""
    status: int = 409
    hidden: Mapping[str, str] = field(default_factory=dict)
    """Fields that are sent and not shown again as typed."""


RECEIVERS, ALERT = "/buildings/TOWER/receivers", "/alerts/1"
ME = {"name": "the manager", "address": "not-an-address"}
MAIL = {"kind": "email", "kinds_alert": "1", "severities_alarm": "1"}
TICKED = ("<option selected>email", 'name="kinds_alert" value="1" checked', 'name="severities_alarm" value="1" checked')
FORMS = {
    "a mail address that is none": Sent(
        RECEIVERS, ME, "receiver-address", "Give one mail address", TICKED, hidden=MAIL
    ),
    "an address with a space": Sent(
        RECEIVERS,
        ME | {"address": "not an address"},
        "receiver-address",
        "must not contain spaces",
        TICKED,
        hidden=MAIL,
    ),
    "a recipient without a name": Sent(
        RECEIVERS, {"address": "a@b.example.org"}, "receiver-name", "must not be empty", TICKED, hidden=MAIL
    ),
    "a kind that does not exist": Sent(
        RECEIVERS, ME, "receiver-kind", "Choose 'email', 'webhook'", TICKED[1:], hidden=MAIL | {"kind": "pigeon"}
    ),
    "a secret that is none": Sent(
        RECEIVERS,
        {"name": "program", "address": "https://example.org/x"},
        "receiver-secret",
        "Must be whsec_ and the base64",
        ("<option selected>webhook",),
        hidden={"kind": "webhook", "secret": "whsec_hunter2"},
    ),
    "acknowledged without a word": Sent(
        f"{ALERT}/acknowledge", {"name": "Jo"}, "acknowledge-note", "must not be empty", hidden={"note": "  "}
    ),
    "acknowledged at length": Sent(
        f"{ALERT}/acknowledge",
        {"name": "Jo", "note": "on my way " * 300},
        "acknowledge-note",
        "must not be longer than 2000 characters",
    ),
    "ended without an outcome": Sent(
        f"{ALERT}/inspect",
        {"note": "two bearings <replaced>", "name": "Jo"},
        "inspect-outcome",
        "Choose 'confirmed' or 'unfounded'",
        ('value="from_now" checked',),
        hidden={"outcome": "perhaps", "reference": "from_now"},
    ),
    "ended with another reference period": Sent(
        f"{ALERT}/inspect",
        {"note": "two bearings replaced"},
        "inspect-reference",
        "Choose one of these reference periods",
        ('<option value="unfounded" selected>',),
        hidden={"outcome": "unfounded", "reference": "never"},
    ),
    "ended without a word": Sent(
        f"{ALERT}/inspect",
        {"name": "Jo"},
        "inspect-note",
        "must not be empty",
        ('value="since_it_began" checked',),
        hidden={"outcome": "unfounded", "reference": "since_it_began"},
    ),
    "silenced for an eternity": Sent(
        "/buildings/TOWER/silences",
        {"pattern": "stiffness", "hours": "9999", "reason": "a load test"},
        "silence-hours",
        "Give a whole number of hours from 1 to 8760",
    ),
    "silenced without a reason": Sent(
        "/buildings/TOWER/silences", {"pattern": "stiff ness", "hours": "12"}, "silence-reason", "must not be empty"
    ),
    "a model of no direction": Sent(
        "/buildings/TOWER/models", {}, "model-direction", "Choose 'x', 'y' or 'xy'", hidden={"direction": "up"}
    ),
    "a key that is none": Sent(
        "/login",
        {"next": "/docs"},
        "login-key",
        "No valid key matches this one",
        status=401,
        hidden={"key": "mk_hunter2"},
    ),
}


@pytest.mark.parametrize("sent", FORMS.values(), ids=FORMS)
def test_a_form_that_is_refused_keeps_what_was_typed_and_says_why(api: httpx.Client, sent: Sent) -> None:
    answer = api.post(sent.path, data={**sent.typed, **sent.hidden}, headers=BROWSER)
    assert answer.status_code == sent.status
    assert answer.headers["content-type"].startswith("text/html")
    shown = unescape(answer.text)
    for name, value in sent.typed.items():
        kept = re.escape(value.strip())
        assert re.search(rf'name="{name}"[^>]*( value="{kept}"|>{kept}</textarea>)', shown), name
    for choice in sent.chosen:
        assert choice in shown
    top, _, form = shown.partition("<h2>")
    assert 'role="alert"' in top
    words = re.escape(sent.words)
    assert re.search(rf'<a href="#{sent.wrong}">[^<]*{words}', top), "at the top, with a way to the field"
    assert re.search(rf'id="{sent.wrong}-wrong">[^<]*{words}', form), "beside the field"
    assert f'id="{sent.wrong}"' in form
    assert "hunter2" not in shown
    for expression in ("pattern '", "[A-Za-z", "\\S"):
        assert expression not in shown


def test_a_recipient_is_refused_in_words_while_no_mail_can_be_sent(url: str) -> None:
    form = {"name": "me", "kind": "email", "address": "me@example.org"}
    with client(url) as api:
        assert "No mail can be sent" in api.get("/buildings/TOWER/messages").text
        answer = api.post(RECEIVERS, data=form, headers=BROWSER)
        listed = api.get("/api/v1/buildings/TOWER/receivers").json()["items"]
    assert answer.status_code == 409
    assert re.search(r'id="receiver-kind-wrong">No mail can be sent[^<]* set smtp\.host', answer.text)
    assert 'value="me@example.org"' in answer.text
    assert "Add a recipient" in answer.text
    assert listed == []


def test_what_was_typed_about_an_alert_that_has_ended_meanwhile_is_kept(api: httpx.Client) -> None:
    form = {"outcome": "unfounded", "note": "a test of the sensors"}
    assert api.post(f"{ALERT}/inspect", data=form).status_code == 303
    late = api.post(f"{ALERT}/acknowledge", data={"note": "on my way to the building"}, headers=BROWSER)
    assert late.status_code == 409
    assert re.search(r'role="alert">\s*<p><b>Not accepted.</b> Alert 1 is withdrawn', late.text)
    assert "on my way to the building</textarea>" in late.text


@pytest.mark.parametrize(
    ("sent", "status", "words"),
    [
        ({"data": {"key": "mk_x"}, "headers": {"Origin": "https://elsewhere.example"}}, 403, "a page of another site"),
        ({"data": {"key": "k" * 10_000}}, 413, "longer than 4096 bytes"),
    ],
)
def test_a_form_that_is_not_read_leads_to_a_page(
    api: httpx.Client, sent: Mapping[str, Any], status: int, words: str
) -> None:
    answer = api.post("/login", data=sent["data"], headers=BROWSER | sent.get("headers", {}))
    assert answer.status_code == status
    assert words in answer.text
    assert '<a href="/">To the buildings</a>' in answer.text


@pytest.mark.parametrize(
    ("referer", "onward"),
    [
        ("http://127.0.0.1:8000/alerts/1", "/alerts/1"),
        ("http://127.0.0.1:8000/alerts/1/acknowledge", "/alerts/1"),
        ("http://127.0.0.1:8000/models/1?hold_out=2", "/models/1?hold_out=2"),
        ("http://127.0.0.1:8000/buildings/TOWER/silences", "/buildings/TOWER"),
        ("https://elsewhere.example/alerts/1", "/"),
        ("http://127.0.0.1:8000//elsewhere.example", "/"),
        ("http://127.0.0.1:8000@elsewhere.example/alerts/1", "/"),
        ("", "/"),
    ],
)
def test_a_form_of_a_session_that_has_ended_leads_to_the_login_and_back(url: str, referer: str, onward: str) -> None:
    headers = BROWSER | {"Origin": "http://127.0.0.1:8000"} | ({"Referer": referer} if referer else {})
    with client(url, visitor=None) as api:
        answer = api.post(f"{ALERT}/acknowledge", data={"note": "on my way"}, headers=headers)
        plain = api.post(f"{ALERT}/acknowledge", data={"note": "on my way"})
    assert answer.status_code == 401
    assert answer.headers["content-type"].startswith("text/html")
    assert answer.headers["content-security-policy"].startswith("default-src 'none'; img-src 'self'")
    assert "Nothing was done." in answer.text
    (next_page,) = re.findall(r'<a href="/login\?next=([^"]*)">Log in and go on</a>', answer.text)
    assert unquote(next_page) == onward
    assert (plain.status_code, plain.headers["content-type"]) == (401, "application/problem+json")


def test_a_form_that_the_role_does_not_allow_leads_back_to_its_page(url: str) -> None:
    headers = BROWSER | {"Referer": "http://127.0.0.1:8000/alerts/1"}
    with client(url, visitor=Caller("guest", Role.viewer)) as api:
        answer = api.post(f"{ALERT}/acknowledge", data={"note": "on my way"}, headers=headers)
    assert answer.status_code == 403
    assert '<a href="/alerts/1">Back to the page of the form</a>' in answer.text


def test_an_error_of_ours_is_a_page_without_its_details(url: str) -> None:
    spoil(url)
    here = {"base_url": "http://127.0.0.1:8000", "client": ("127.0.0.1", 40000)}
    app = create(Settings(database_url=url), VISITOR)
    with TestClient(app, raise_server_exceptions=False, **here) as api:  # type: ignore[arg-type]
        answer = api.get(ALERT, headers=BROWSER)
    assert answer.status_code == 500
    assert "Something went wrong in Menshin; its log has the details." in answer.text
    assert '<a href="/">To the buildings</a>' in answer.text
    assert "Traceback" not in answer.text
    assert "hunter2" not in answer.text
