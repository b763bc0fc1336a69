"""A drill from end to end: the real command, the real notifier, a mail server and a program that checks signatures."""

import json
from base64 import b64decode
from pathlib import Path

import databases
import monitored_building
import pytest
from processes import interrupt, run, running_command
from receivers import mail_server, webhook_server
from rendered_messages import KEY
from standardwebhooks import Webhook

from service.buildings import recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.db import sessions as opened
from service.notify.texts import DRILL

pytestmark = pytest.mark.slow


def test_a_drill_arrives_everywhere_with_its_picture_and_cannot_be_mistaken_for_real(tmp_path: Path) -> None:
    url = databases.sqlite(tmp_path)
    sessions = opened.sessions(url)
    (tmp_path / "records").mkdir()
    monitored_building.watch(sessions, tmp_path / "records", monitored_building.earthquakes()[:1])
    with webhook_server() as program, webhook_server() as chat, mail_server() as box:
        rules = (
            ReceiverRule("manager", "email", "manager@example.org", None, WANTED_KINDS, SEVERITIES),
            ReceiverRule("program", "webhook", program.address, KEY, WANTED_KINDS, SEVERITIES),
            ReceiverRule(
                "chat", "apprise", f"json://127.0.0.1:{chat.address.rpartition(':')[2]}", None, WANTED_KINDS, SEVERITIES
            ),
            ReceiverRule("calm", "email", "calm@example.org", None, ("event",), SEVERITIES),
        )
        with sessions.begin() as session:
            building = building_store.find(session, "PAPER")
            for rule in rules:
                recipients.add(session, building.id, rule, "engineer", monitored_building.NOW)
        alone = run(tmp_path, url, "drill", "--building", "PAPER", "--wait", "0")
        assert alone.returncode == 1, "nobody delivers yet"
        assert "menshin notify" in alone.stdout
        settings = {
            "MENSHIN_NOTIFY__ALLOWED_PRIVATE_HOSTS": '["localhost", "127.0.0.1"]',
            "MENSHIN_NOTIFY__ALLOW_PLAIN_HTTP": "true",
            "MENSHIN_SMTP__HOST": "localhost",
            "MENSHIN_SMTP__PORT": str(box.port),
            "MENSHIN_SMTP__SECURITY": "none",
        }
        with running_command(tmp_path, url, "notify", **settings) as notifier:
            held = run(tmp_path, url, "drill", "--building", "PAPER", "--wait", "60")
            assert held.returncode == 0, held.stdout + held.stderr
            assert held.stdout.count("delivered") == 3
            assert interrupt(notifier) == 0
        assert {mail["To"] for mail in box.mails} == {"manager@example.org"}
        mail = box.mails[-1]
        assert f"{DRILL}: " in mail["Subject"]
        [picture] = [part for part in mail.walk() if part.get_content_type() == "image/png"]
        assert picture.get_content().startswith(b"\x89PNG")
        assert len(picture.get_content()) > 10_000
        [attached] = json.loads(chat.posted[-1].body)["attachments"]
        assert b64decode(attached["base64"]) == picture.get_content()
        one = program.posted[-1]
        assert Webhook(KEY).verify(one.body, dict(one.headers))["type"] == "menshin.drill.v1"
        assert json.loads(one.body)["data"]["is_real"] is False
    unknown = run(tmp_path, url, "drill", "--building", "NOWHERE")
    assert (unknown.returncode, "PAPER" in unknown.stderr) == (2, True)
    sessions.kw["bind"].dispose()
