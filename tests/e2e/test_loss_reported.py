"""A building that loses stiffness: an active alert, and messages by mail and to a program."""

from pathlib import Path
from time import monotonic, sleep

import databases
import pytest
import stored_histories
from processes import interrupt, running_command
from receivers import mail_server, webhook_server
from rendered_messages import KEY
from sqlalchemy import select
from standardwebhooks import Webhook

from service.alerts.tables import Alert
from service.buildings import recipients
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverRule
from service.db import sessions as opened

pytestmark = pytest.mark.slow
NOW = stored_histories.start(30)
PATIENCE = 60.0
"""s."""


def test_a_loss_of_eight_percent_is_reported_once_by_mail_and_in_a_signed_request(
    tmp_path: Path,
) -> None:
    url = databases.sqlite(tmp_path)
    sessions = opened.sessions(url)
    with webhook_server() as program, mail_server() as box:
        with sessions.begin() as session:
            building = stored_histories.building(session).id
            for name, kind, address, key in (
                ("manager", "email", "manager@example.org", None),
                ("program", "webhook", program.address, KEY),
            ):
                rule = ReceiverRule(name, kind, address, key, WANTED_KINDS, SEVERITIES)
                recipients.add(session, building, rule, "engineer", NOW)
        stored_histories.store_and_monitor(sessions, building, stored_histories.store_history(26, onset=21), NOW)
        settings = {
            "MENSHIN_NOTIFY__ALLOWED_PRIVATE_HOSTS": '["localhost"]',
            "MENSHIN_NOTIFY__ALLOW_PLAIN_HTTP": "true",
            "MENSHIN_PUBLIC_URL": "https://menshin.example.org",
            "MENSHIN_SMTP__HOST": "localhost",
            "MENSHIN_SMTP__PORT": str(box.port),
            "MENSHIN_SMTP__SECURITY": "none",
        }
        with running_command(tmp_path, url, "notify", **settings) as notifier:
            deadline = monotonic() + PATIENCE
            while not (box.mails and program.posted) and monotonic() < deadline:
                sleep(0.1)
            assert interrupt(notifier) == 0
    with sessions() as session:
        (alert,) = session.scalars(select(Alert).where(Alert.state == "active", Alert.cause == "stiffness"))
    mails = [mail for mail in box.mails if "softer" in mail["Subject"]]
    assert len(mails) == 1
    text = mails[0].get_body(("plain",))
    assert text is not None
    words = text.get_content()
    assert "Have them inspected by a specialist." in " ".join(words.split())
    assert f"https://menshin.example.org/alerts/{alert.id}" in words
    signed = [Webhook(KEY).verify(one.body, dict(one.headers)) for one in program.posted]
    assert {one["type"] for one in signed} == {"menshin.alert.v1"}
    alerts = [alert for one in signed for alert in one["data"]["values"]["alerts"]]
    (raised,) = [one for one in alerts if one["cause"] == "stiffness"]
    assert raised["id"] == alert.id
    assert raised["evidence"]["low"] < -0.08 < raised["evidence"]["high"]
    sessions.kw["bind"].dispose()
