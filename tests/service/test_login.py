"""How a browser comes in, and who does not."""

from datetime import UTC, datetime

import pytest
from asking import client
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys
from service.access.auth import COOKIE, Role

NOW = datetime(2024, 1, 1, tzinfo=UTC)


@pytest.fixture
def key(sessions: sessionmaker[Session]) -> str:
    with sessions.begin() as session:
        return keys.create(session, "people", Role.viewer, NOW)


def test_a_page_asks_for_the_key_and_then_comes(database_url: str, key: str) -> None:
    with client(database_url) as asking:
        sent = asking.get("/?building=TWR")
        assert (sent.status_code, sent.headers["location"]) == (303, "/login?next=%2F%3Fbuilding%3DTWR")
        assert 'value="/?building=TWR"' in asking.get(sent.headers["location"]).text
        answer = asking.post("/login", data={"key": f" {key}\n", "next": "/docs"})
        assert (answer.status_code, answer.headers["location"]) == (303, "/docs")
        assert asking.get("/docs").status_code == 200
        assert asking.get("/api/v1/buildings").status_code == 200


def test_no_script_and_no_other_site_gets_the_cookie(database_url: str, key: str) -> None:
    with client(database_url) as asking:
        plain = asking.post("/login", data={"key": key}).headers["set-cookie"]
        proxied = asking.post("/login", data={"key": key}, headers={"Origin": "https://127.0.0.1:8000"}).headers[
            "set-cookie"
        ]
    with client(database_url, scheme="https") as asking:
        safe = asking.post("/login", data={"key": key}).headers["set-cookie"]
    for cookie in (plain, proxied, safe):
        assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(cookie.split("; "))
    assert ["Secure" in cookie for cookie in (plain, proxied, safe)] == [False, True, True]


def test_a_wrong_key_is_told_what_a_right_one_is(database_url: str, key: str) -> None:
    with client(database_url) as asking:
        answer = asking.post("/login", data={"key": key[:-1], "next": "/docs"})
    assert answer.status_code == 401
    assert "menshin key create" in answer.text
    assert 'value="/docs"' in answer.text
    assert key[:-1] not in answer.text
    assert "set-cookie" not in answer.headers


def test_a_revoked_key_is_asked_for_again(database_url: str, key: str, sessions: sessionmaker[Session]) -> None:
    with sessions.begin() as session:
        keys.create(session, "other", Role.viewer, NOW)
        keys.revoke(session, "people", NOW)
    with client(database_url) as asking:
        asking.cookies.set(COOKIE, key)
        assert asking.get("/").headers["location"] == "/login?next=%2F"


def test_who_logs_out_is_out(database_url: str, key: str) -> None:
    with client(database_url) as asking:
        asking.post("/login", data={"key": key})
        assert "Log out" in asking.get("/").text
        assert asking.post("/logout").headers["location"] == "/login"
        assert COOKIE not in asking.cookies
        assert asking.get("/").status_code == 303


@pytest.mark.parametrize("path", ["/login", "/logout"])
@pytest.mark.parametrize("origin", ["http://evil.example", "null"])
def test_another_sites_page_logs_nobody_in_or_out(database_url: str, key: str, path: str, origin: str) -> None:
    with client(database_url) as asking:
        answer = asking.post(path, data={"key": key}, headers={"Origin": origin})
    assert answer.status_code == 403
    assert "set-cookie" not in answer.headers


@pytest.mark.parametrize("onward", ["http://evil.example/", "//evil.example", "/\\evil.example", "/\tx", "", "docs"])
def test_nobody_is_sent_to_another_site(database_url: str, key: str, onward: str) -> None:
    with client(database_url) as asking:
        assert asking.post("/login", data={"key": key, "next": onward}).headers["location"] == "/"
        assert "evil" not in asking.get("/login", params={"next": onward}).text


def test_a_form_of_any_length_is_not_read(database_url: str) -> None:
    with client(database_url) as asking:
        assert asking.post("/login", data={"key": "k" * 10_000}).status_code == 413
