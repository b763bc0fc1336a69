"""Logins of browsers, and refused ones."""

from datetime import UTC, datetime
from time import sleep

import pytest
from api_client import client
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys, logins
from service.access.auth import COOKIE, SAFE_COOKIE
from service.access.callers import FRESH
from service.access.logins import ATTEMPTS
from service.access.roles import Role
from service.access.tables import AuditEntry, LoginLink, LoginSession

pytestmark = pytest.mark.sqlite

NOW = datetime(2024, 1, 1, tzinfo=UTC)


@pytest.fixture
def key(sessions: sessionmaker[Session]) -> str:
    with sessions.begin() as session:
        return keys.create(session, "people", Role.viewer, NOW)


def test_a_page_requests_the_key_and_then_comes(database_url: str, key: str) -> None:
    with client(database_url) as api:
        sent = api.get("/?building=TWR")
        assert (sent.status_code, sent.headers["location"]) == (303, "/login?next=%2F%3Fbuilding%3DTWR")
        assert 'value="/?building=TWR"' in api.get(sent.headers["location"]).text
        answer = api.post("/login", data={"key": f" {key}\n", "next": "/docs"})
        assert (answer.status_code, answer.headers["location"]) == (303, "/docs")
        assert api.get("/docs").status_code == 200
        assert api.get("/api/v1/buildings").status_code == 200


def test_no_script_and_no_other_site_gets_the_cookie(database_url: str, key: str) -> None:
    """By https its name makes browsers insist on https, and on this host alone."""
    origin = {"Origin": "https://127.0.0.1:8000"}
    with client(database_url) as api:
        plain = api.post("/login", data={"key": key}).headers["set-cookie"]
        proxied = api.post("/login", data={"key": key}, headers=origin).headers["set-cookie"]
    with client(database_url, scheme="https") as api:
        safe = api.post("/login", data={"key": key}).headers["set-cookie"]
    for cookie in (plain, proxied, safe):
        assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(cookie.split("; "))
        assert "Domain" not in cookie
        assert key not in cookie
    assert ["Secure" in cookie for cookie in (plain, proxied, safe)] == [False, True, True]
    assert [cookie.partition("=")[0] for cookie in (plain, proxied, safe)] == [COOKIE, SAFE_COOKIE, SAFE_COOKIE]


def test_by_https_a_cookie_that_anybody_may_have_planted_does_not_count(database_url: str, key: str) -> None:
    with client(database_url, public_url="https://menshin.example.org") as api:
        api.post("/login", data={"key": key})
        planted = {"Cookie": f"{COOKIE}={api.cookies[COOKIE]}"}
        assert api.get("/", headers={"Host": "menshin.example.org"} | planted).status_code == 303
        proper = {"Cookie": f"{SAFE_COOKIE}={api.cookies[COOKIE]}"}
        assert api.get("/", headers={"Host": "menshin.example.org"} | proper).status_code == 200


def test_neither_the_cookie_nor_a_links_token_is_stored(
    database_url: str, key: str, sessions: sessionmaker[Session]
) -> None:
    with sessions.begin() as session:
        token = logins.new_link(session, datetime.now(UTC))
    with client(database_url) as api:
        api.post("/login", data={"key": key})
        cookie = api.cookies[COOKIE]
    with sessions() as session:
        stored = [one.hash for table in (LoginSession, LoginLink) for one in session.query(table)]
        trail = [(one.by, one.details) for one in session.query(AuditEntry)]
    assert len(stored) == 2
    assert not any(secret in one for secret in (cookie, token, key) for one in stored)
    assert trail == [("people", {"session": "begun"})]


def test_a_wrong_key_learns_what_a_right_one_is(database_url: str, key: str) -> None:
    with client(database_url) as api:
        answer = api.post("/login", data={"key": key[:-1], "next": "/docs"})
    assert answer.status_code == 401
    assert "menshin key create" in answer.text
    assert 'value="/docs"' in answer.text
    assert key[:-1] not in answer.text
    assert "set-cookie" not in answer.headers


def test_revoking_the_key_ends_its_sessions(database_url: str, key: str, sessions: sessionmaker[Session]) -> None:
    with client(database_url) as api:
        api.post("/login", data={"key": key})
        assert api.get("/").status_code == 200
        with sessions.begin() as session:
            keys.create(session, "other", Role.viewer, NOW)
            keys.revoke(session, "people", NOW)
        sleep(FRESH)
        assert api.get("/").headers["location"] == "/login?next=%2F"


def test_an_api_key_is_no_cookie(database_url: str, key: str) -> None:
    with client(database_url) as api:
        api.cookies.set(COOKIE, key)
        assert api.get("/").status_code == 303


def test_who_logs_out_is_out_with_every_copy_of_the_cookie(
    database_url: str, key: str, sessions: sessionmaker[Session]
) -> None:
    with client(database_url) as api:
        api.post("/login", data={"key": key})
        assert "Log out" in api.get("/").text
        stolen = api.cookies[COOKIE]
        assert api.post("/logout").headers["location"] == "/login"
        assert COOKIE not in api.cookies
        api.cookies.set(COOKIE, stolen)
        assert api.get("/").status_code == 303
    with sessions() as session:
        assert [one.details["session"] for one in session.query(AuditEntry)] == ["begun", "ended"]


def test_a_link_logs_an_admin_in_once(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        earlier, token = (logins.new_link(session, datetime.now(UTC)) for _ in range(2))
    with client(database_url, visitor=None) as api:
        assert api.get("/login", params={"token": earlier}).status_code == 401, "a newer one is there"
        answer = api.get("/login", params={"token": token, "next": "/docs"})
        assert (answer.status_code, answer.headers["location"]) == (303, "/docs")
        assert api.delete("/api/v1/receivers/1").status_code == 404, "an admin asks"
        api.cookies.clear()
        again = api.get("/login", params={"token": token})
        assert again.status_code == 401
        assert "menshin login" in again.text
        assert "set-cookie" not in again.headers


def test_an_old_link_logs_no_one_in(database_url: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        token = logins.new_link(session, datetime.now(UTC) - logins.LINK_LASTS)
    with client(database_url, visitor=None) as api:
        assert api.get("/login", params={"token": token}).status_code == 401


def test_an_address_that_is_refused_too_often_waits(
    database_url: str, key: str, sessions: sessionmaker[Session]
) -> None:
    with client(database_url) as api:
        answers = [api.post("/login", data={"key": f"mk_{number}"}) for number in range(ATTEMPTS + 2)]
        assert [one.status_code for one in answers] == [401] * ATTEMPTS + [429] * 2
        assert 0 < int(answers[-1].headers["retry-after"]) <= 60
        assert api.post("/login", data={"key": key}).status_code == 429, "a right guess is refused like a wrong one"
        assert api.get("/api/v1/buildings", headers={"X-API-Key": key}).status_code == 200
    with sessions() as session:
        assert [one.details["session"] for one in session.query(AuditEntry)] == ["refused"] * ATTEMPTS


@pytest.mark.parametrize("path", ["/login", "/logout"])
@pytest.mark.parametrize("origin", ["http://evil.example", "null"])
def test_another_sites_page_logs_no_one_in_or_out(database_url: str, key: str, path: str, origin: str) -> None:
    with client(database_url) as api:
        answer = api.post(path, data={"key": key}, headers={"Origin": origin})
    assert answer.status_code == 403
    assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("onward", ["http://evil.example/", "//evil.example", "/\\evil.example", "/\tx", "", "docs"])
def test_no_one_is_sent_to_another_site(database_url: str, key: str, onward: str) -> None:
    with client(database_url) as api:
        assert api.post("/login", data={"key": key, "next": onward}).headers["location"] == "/"
        assert "evil" not in api.get("/login", params={"next": onward}).text


def test_a_form_of_any_length_is_not_read(database_url: str) -> None:
    with client(database_url) as api:
        assert api.post("/login", data={"key": "k" * 10_000}).status_code == 413
