"""Recipients and messages by API and page: deliveries, drills, replays, and hidden secrets."""

import json
import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from api_client import client
from building_files import SMALL
from fastapi.testclient import TestClient
from receivers import WebhookServer, webhook_server
from rendered_messages import KEY
from sqlalchemy import select, update
from sqlalchemy.orm import Session, sessionmaker
from standardwebhooks import Webhook

from service.access import keys
from service.access.auth import Role
from service.access.tables import AuditEntry
from service.buildings import store as building_store
from service.notify import drill
from service.notify.notifier import Notifier
from service.notify.outbox import MessageContent, put
from service.notify.tables import Message
from service.settings import Settings

pytestmark = pytest.mark.sqlite

NOW = datetime(2024, 1, 1, tzinfo=UTC)
RECEIVERS = "/api/v1/buildings/TOWER/receivers"
MANAGER = '\n[[receiver]]\nname = "manager"\nkind = "email"\naddress = "manager@example.org"\n'
OPEN = {"inside_allowed": ("localhost",), "plain_http_allowed": True, "notice_attempts": 1}


@pytest.fixture
def api(database_url: str, sessions: sessionmaker[Session]) -> Iterator[TestClient]:
    with sessions.begin() as session:
        building_store.add(session, SMALL + MANAGER, Path("/"), NOW)
    with client(database_url, smtp_host="localhost") as made:
        yield made


@pytest.fixture
def program() -> Iterator[WebhookServer]:
    with webhook_server() as server:
        yield server


def added(api: TestClient, program: WebhookServer, **other: object) -> dict[str, Any]:
    wanted = {"name": "program", "kind": "webhook", "address": f"{program.address}/hook/token-of-ours"}
    answer = api.post(RECEIVERS, json=wanted | other)
    assert answer.status_code == 201, answer.text
    found: dict[str, Any] = answer.json()
    return found


def notified(sessions: sessionmaker[Session]) -> None:
    Notifier(sessions, Settings(**OPEN)).run_until_idle()  # type: ignore[arg-type]


def shown(api: TestClient, path: str) -> str:
    answer = api.get(path)
    assert answer.status_code == 200, answer.text
    assert not re.search(r"<script(?! src=./static/\w+\.js.[^<>]*></script>)", answer.text)
    return unescape(re.sub(r"\s+", " ", re.sub("<[^>]+>", " ", answer.text)))


def test_receivers_are_added_changed_and_removed(api: TestClient, program: WebhookServer) -> None:
    made = added(api, program, kinds=["alert"], severities=["alarm"])
    place = f"/api/v1/receivers/{made['id']}"
    assert api.get(place).json() == {name: value for name, value in made.items() if name != "secret"}
    assert (made["kinds"], made["severities"], made["origin"]) == (["alert"], ["alarm"], "api")
    changed = api.patch(place, json={"kinds": ["event", "alert"]}).json()
    assert changed == api.get(place).json()
    assert (changed["kinds"], changed["severities"]) == (["event", "alert"], ["alarm"])
    assert api.patch(place, json={}).status_code == 409
    assert api.patch(place, json={"report": True}).status_code == 409  # a program reads the event itself
    assert api.patch(place, json={"language": "ja"}).status_code == 409
    assert [one["name"] for one in api.get(RECEIVERS).json()["items"]] == ["manager", "program"]
    assert api.delete(place).status_code == 204
    assert api.get(place).status_code == api.delete(place).status_code == 404


def test_the_files_receivers_are_the_files(api: TestClient) -> None:
    [manager] = api.get(RECEIVERS).json()["items"]
    place = f"/api/v1/receivers/{manager['id']}"
    for answer in (api.delete(place), api.patch(place, json={"address": "a@b.org"})):
        assert (answer.status_code, "building file" in answer.json()["detail"]) == (409, True)


@pytest.mark.parametrize(
    ("wrong", "status"),
    [
        ({"kind": "email", "address": "nobody"}, 409),
        ({"kind": "webhook", "address": "ftp://example.org"}, 409),
        ({"kind": "webhook", "address": "https://a.b", "secret": "whsec_short"}, 409),
        ({"kind": "webhook", "address": "https://a.b", "secret": "env:HOME"}, 409),
        ({"kind": "apprise", "address": "env:HOME"}, 409),
        ({"kind": "email", "address": "a@b.org", "name": "manager"}, 409),
        ({"kind": "apprise", "address": "json://127.0.0.1/b", "report": True}, 409),
        ({"kind": "alertmanager", "address": "https://a.b", "language": "ja"}, 409),
        ({"kind": "email", "address": "a@b.org", "language": "fr"}, 422),
        ({"kind": "pigeon", "address": "a@b.org"}, 422),
        ({"kind": "email", "address": "a@b.org", "kinds": []}, 422),
    ],
)
def test_what_will_not_do_is_refused(api: TestClient, wrong: dict[str, object], status: int) -> None:
    assert api.post(RECEIVERS, json={"name": "another"} | wrong).status_code == status


def test_a_person_s_language_is_chosen_and_changed(api: TestClient) -> None:
    made = api.post(RECEIVERS, json={"name": "me", "kind": "email", "address": "a@b.org", "language": "ja"}).json()
    assert made["language"] == "ja"
    place = f"/api/v1/receivers/{made['id']}"
    assert api.patch(place, json={"severities": ["alarm"]}).json()["language"] == "ja", "what is not given stays"
    assert api.patch(place, json={"language": "en"}).json() == api.get(place).json()
    assert api.get(place).json()["language"] == "en"
    refused = api.patch(place, json={"language": "fr"})
    assert refused.status_code == 422
    assert "'en' or 'ja'" in refused.text


def test_a_mail_recipient_is_refused_as_long_as_no_mail_can_be_sent(api: TestClient, database_url: str) -> None:
    wanted = {"name": "me", "kind": "email", "address": "me@example.org"}
    with client(database_url) as without:
        refused = without.post(RECEIVERS, json=wanted)
        assert (refused.status_code, refused.headers["content-type"]) == (409, "application/problem+json")
        assert "no mail can be sent" in refused.json()["detail"]
        assert "smtp.host" in refused.json()["detail"]
        assert without.post("/buildings/TOWER/receivers", data=wanted).status_code == 409
        assert [one["name"] for one in without.get(RECEIVERS).json()["items"]] == ["manager"]
    assert api.post(RECEIVERS, json=wanted).status_code == 201


def test_a_secret_is_shown_once_and_then_nowhere(
    api: TestClient, program: WebhookServer, sessions: sessionmaker[Session]
) -> None:
    made = added(api, program)
    assert made["secret"].startswith("whsec_")
    given = added(api, program, name="given", secret=KEY)
    assert given["secret"] is None, "they know it"
    api.post(f"/api/v1/receivers/{made['id']}/test")
    api.post(RECEIVERS, json={"name": "chat", "kind": "apprise", "address": "slack://token-of-ours/b/c"})
    notified(sessions)
    Webhook(made["secret"]).verify(program.posted[0].body, dict(program.posted[0].headers))
    seen = "".join(
        api.get(path).text
        for path in (
            RECEIVERS,
            "/api/v1/deliveries",
            "/api/v1/deliveries/1",
            "/buildings/TOWER/messages",
            "/messages/1",
        )
    )
    with sessions() as session:
        seen += str([(one.details, one.target) for one in session.scalars(select(AuditEntry))])
    assert "program" in seen
    for secret in (made["secret"], KEY, "token-of-ours"):
        assert secret not in seen


def test_a_test_message_goes_to_one_recipient_and_is_marked(
    api: TestClient, program: WebhookServer, sessions: sessionmaker[Session]
) -> None:
    number = added(api, program, kinds=["alert"])["id"]
    answer = api.post(f"/api/v1/receivers/{number}/test")
    assert answer.status_code == 202
    place = answer.headers["Location"]
    assert api.get(place).json()["state"] == "waiting"
    notified(sessions)
    found = api.get(place).json()
    assert (found["state"], found["attempts"], found["kind"]) == ("delivered", 1, "test")
    [attempt] = found["log"]
    assert (attempt["outcome"], attempt["answer"], attempt["is_repeat"]) == ("delivered", "204", False)
    assert attempt["address"] == f"{program.address}/…"
    event = json.loads(program.posted[0].body)
    assert (event["type"], event["data"]["is_real"]) == ("menshin.test.v1", False)
    assert len(program.posted) == 1


def test_what_failed_is_replayed(api: TestClient, program: WebhookServer, sessions: sessionmaker[Session]) -> None:
    number = added(api, program)["id"]
    program.status = 404
    place = api.post(f"/api/v1/receivers/{number}/test").headers["Location"]
    assert api.post(f"{place}/replay").status_code == 409, "it has not failed yet"
    notified(sessions)
    assert api.get(place).json()["state"] == "failed"
    assert [one["id"] for one in api.get("/api/v1/deliveries?state=failed").json()["items"]] == [1]
    program.status = 204
    again = api.post(f"{place}/replay")
    assert (again.status_code, again.json()["state"]) == (202, "waiting")
    notified(sessions)
    found = api.get(place).json()
    assert (found["state"], [one["outcome"] for one in found["log"]]) == ("delivered", ["not_taken", "delivered"])


def test_messages_and_deliveries_page_by_page_and_as_csv(
    api: TestClient, program: WebhookServer, sessions: sessionmaker[Session]
) -> None:
    added(api, program)
    with sessions.begin() as session:
        building = building_store.find(session, "TOWER").id
        for number in range(3):
            printed = MessageContent(
                f"event/{number}", building, "event", "new", "note", f"Number {number}", ("Said.",)
            )
            put(session, printed, NOW)
    first = api.get("/api/v1/buildings/TOWER/messages?limit=2").json()
    assert [one["subject"] for one in first["items"]] == ["Number 2", "Number 1"]
    rest = api.get(f"/api/v1/buildings/TOWER/messages?limit=2&cursor={first['next']}").json()
    assert ([one["subject"] for one in rest["items"]], rest["next"]) == (["Number 0"], None)
    assert (rest["items"][0]["receivers"], rest["items"][0]["delivered"]) == (2, 0)
    whole = api.get(f"/api/v1/messages/{rest['items'][0]['id']}").json()
    assert (whole["sentences"], [one["receiver_name"] for one in whole["deliveries"]]) == (
        ["Said."],
        ["manager", "program"],
    )
    lines = api.get("/api/v1/deliveries?building=TOWER&format=csv").text.splitlines()
    assert lines[0].startswith("id,building,message,about,")
    assert len(lines) == 7
    assert api.get("/api/v1/deliveries?building=OTHER").json()["items"] == []
    assert api.get("/api/v1/deliveries?receiver=1").json()["items"][0]["receiver_name"] == "manager"


def test_a_drill_by_the_page(api: TestClient, program: WebhookServer, sessions: sessionmaker[Session]) -> None:
    added(api, program)
    sent = api.post("/buildings/TOWER/drill")
    assert (sent.status_code, sent.headers["location"]) == (303, "/messages/1")
    page = shown(api, "/messages/1")
    assert "A drill: not real." in page
    assert "waiting" in page
    notified(sessions)
    page = shown(api, "/messages/1")
    assert "program (webhook): delivered" in page
    assert "manager (email): failed" in page
    assert "no mail server is set; set smtp.host" in page
    page = shown(api, "/buildings/TOWER/messages")
    assert "Kind, severity Recipient" in page
    assert "drill, not real" in page
    assert "loopback started this drill." in shown(api, "/messages/1")
    assert api.post("/deliveries/1/replay").headers["location"] == "/messages/1"


def test_receivers_by_the_page(api: TestClient, program: WebhookServer, sessions: sessionmaker[Session]) -> None:
    form = {"name": "mail", "kind": "email", "address": "a@b.org", "kinds_alert": "1", "severities_alarm": "1"}
    form |= {"report": "1", "language": "ja"}
    assert api.post("/buildings/TOWER/receivers", data=form).headers["location"] == "/buildings/TOWER/messages"
    assert "mail email a@b.org alert alarm 日本語 as PDF loopback" in shown(api, "/buildings/TOWER/messages")
    hooked = {"name": "hook", "kind": "webhook", "address": program.address}
    refused = api.post("/buildings/TOWER/receivers", data=hooked | {"language": "ja"})
    assert (refused.status_code, "rograms get messages in English" in refused.text) == (409, True)
    in_japanese = {"headers": {"Accept-Language": "ja"}}
    refused = api.post("/buildings/TOWER/receivers", data=hooked | {"language": "ja"}, **in_japanese)
    assert "プログラムへの通知は英語です" in refused.text
    assert "rograms get" not in refused.text
    made = api.post("/buildings/TOWER/receivers", data=hooked)
    assert made.status_code == 201
    assert "whsec_" in made.text
    assert api.post("/receivers/2/test").headers["location"] == "/messages/1"
    assert api.post("/receivers/2/remove").status_code == 303
    assert "a@b.org" not in shown(api, "/buildings/TOWER/messages")
    assert api.post("/buildings/TOWER/receivers", data=form | {"kind": "pigeon"}).status_code == 409


def test_who_may_do_what(
    api: TestClient, program: WebhookServer, sessions: sessionmaker[Session], database_url: str
) -> None:
    number = added(api, program)["id"]
    with sessions.begin() as session:
        key = {role: keys.create(session, role.name, role, NOW) for role in Role}
    wanted = {"name": "other", "kind": "email", "address": "a@b.org"}
    with client(database_url, smtp_host="localhost") as anew:  # the keys are read once a second
        for role in Role:
            anew.headers["X-API-Key"] = key[role]
            assert anew.get("/api/v1/deliveries").status_code == 200
            tested = anew.post(f"/api/v1/receivers/{number}/test")
            assert tested.status_code == (202 if role >= Role.engineer else 403)
            made = anew.post(RECEIVERS, json=wanted)
            assert made.status_code == (201 if role is Role.admin else 403)
            page = anew.get("/buildings/TOWER/messages").text
            assert ("Start a drill" in page, "Add a recipient" in page) == (role >= Role.engineer, role is Role.admin)


def test_metrics_show_what_waits_and_what_failed(
    api: TestClient, program: WebhookServer, sessions: sessionmaker[Session]
) -> None:
    added(api, program)
    api.post("/buildings/TOWER/drill")
    text = api.get("/metrics").text
    assert 'menshin_deliveries{state="waiting"} 2.0' in text
    assert re.search(r"^menshin_oldest_waiting_delivery_timestamp_seconds 1\d{9}\.\d+$", text, re.MULTILINE)
    assert 'menshin_failed_deliveries{building="TOWER"} 0.0' in text
    notified(sessions)
    text = api.get("/metrics").text
    assert 'menshin_deliveries{state="delivered"} 1.0' in text
    assert 'menshin_failed_deliveries{building="TOWER"} 1.0' in text
    assert "\nmenshin_oldest_waiting_delivery_timestamp_seconds" not in text


def test_drills_and_tests_of_a_building_are_limited(api: TestClient, sessions: sessionmaker[Session]) -> None:
    (manager,) = api.get(RECEIVERS).json()["items"]
    ways = ("/api/v1/buildings/TOWER/drill", f"/api/v1/receivers/{manager['id']}/test")
    answers = [api.post(ways[number % 2]) for number in range(drill.MOST_PER_HOUR + 2)]
    assert [answer.status_code for answer in answers] == [202] * drill.MOST_PER_HOUR + [429] * 2
    assert "within the last hour" in answers[-1].json()["detail"]
    assert int(answers[-1].headers["Retry-After"]) > 0
    an_hour_ago = datetime.now(UTC) - timedelta(minutes=61)
    with sessions.begin() as session:
        session.execute(update(Message).values(created_at=an_hour_ago))
    assert api.post(ways[0]).status_code == 202
