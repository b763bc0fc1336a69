"""Every answer names its request, and so do the lines that the log has about it."""

import logging

import pytest
from api_client import client
from fastapi.testclient import TestClient

from service import logs
from service.app import create
from service.settings import Settings

pytestmark = pytest.mark.sqlite


def test_a_given_identity_is_kept_and_a_wrong_one_replaced(database_url: str) -> None:
    with client(database_url) as api:
        assert api.get("/healthz", headers={"X-Request-ID": "proxy-17.a"}).headers["X-Request-ID"] == "proxy-17.a"
        made = [api.get("/healthz", headers={"X-Request-ID": wrong}) for wrong in ("a b", 'a"b', "x" * 65, "")]
        identities = {one.headers["X-Request-ID"] for one in made}
        assert len(identities) == len(made)
        assert all(len(one) == 32 and one.isalnum() for one in identities)
        assert api.get("/api/v1/buildings/NONE").headers["X-Request-ID"]


def test_the_answer_about_a_bug_and_lines_of_its_request_have_its_identity(database_url: str) -> None:
    app = create(Settings(database_url=database_url))
    noted: list[str] = []

    async def broken() -> None:
        noted.append(logs.JsonLine().format(logging.makeLogRecord({"msg": "here"})))
        raise RuntimeError("a bug")

    app.add_api_route("/broken", broken)
    with TestClient(app, raise_server_exceptions=False) as api:
        answer = api.get("/broken", headers={"X-Request-ID": "request-1"})
    assert (answer.status_code, answer.headers["X-Request-ID"]) == (500, "request-1")
    assert '"request": "request-1"' in noted[0]
