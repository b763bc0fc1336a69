"""An Alertmanager: the requests of its API, active alerts and ended ones."""

import json
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from receivers import WebhookServer, webhook_server
from rendered_messages import WRITTEN, rendered_message

from service.notify.channels.alertmanager import send
from service.notify.rendering import Destination, RenderedMessage
from service.notify.texts import DRILL
from service.settings import Settings

SETTINGS = Settings(inside_allowed=("localhost",), plain_http_allowed=True, alertmanager_interval=30)
NOW = datetime(2024, 3, 2, tzinfo=UTC)


@pytest.fixture
def there() -> Iterator[WebhookServer]:
    with webhook_server() as server:
        yield server


def pushed(there: WebhookServer, one: RenderedMessage, now: datetime = NOW) -> dict[str, Any]:
    to = Destination("manager", "alertmanager", f"{there.address}/prefix/", None)
    assert send(one, to, SETTINGS, now).outcome == "delivered"
    assert there.posted[-1].path == "/prefix/api/v2/alerts"
    [alert] = json.loads(there.posted[-1].body)
    assert set(alert) <= {"labels", "annotations", "startsAt", "endsAt", "generatorURL"}, "those of postableAlert"
    assert all(isinstance(value, str) for part in ("labels", "annotations") for value in alert[part].values())
    return dict(alert)


def note(**other: object) -> RenderedMessage:
    return rendered_message(**({"kind": "alert", "key": "alert/5", "severity": "alarm", "gravest": "alarm"} | other))


def test_an_active_alert_ends_after_several_repetition_intervals(there: WebhookServer) -> None:
    alert = pushed(there, note())
    assert alert["labels"] == {
        "alertname": "MenshinAlert",
        "building": "TOWER",
        "about": "alert/5",
        "severity": "alarm",
        "real": "true",
    }
    assert datetime.fromisoformat(alert["startsAt"]) == WRITTEN
    assert datetime.fromisoformat(alert["endsAt"]) == NOW + timedelta(seconds=120)
    assert alert["generatorURL"] == "https://menshin.example.org/events/17"


@pytest.mark.parametrize("end", [{"severity": "note", "has_ended": True}, {"sequence": "cancelled"}])
def test_what_is_over_ends_the_same_alert(there: WebhookServer, end: dict[str, object]) -> None:
    over = pushed(there, note(number=2, identity="msg_9", subject="Resolved", **end))
    assert over["labels"] == pushed(there, note())["labels"]
    assert datetime.fromisoformat(over["endsAt"]) == NOW


def test_an_earthquake_and_a_drill_pass_by_themselves(there: WebhookServer) -> None:
    for kind in ("event", "drill"):
        alert = pushed(there, rendered_message(kind=kind))
        assert datetime.fromisoformat(alert["endsAt"]) - WRITTEN == timedelta(minutes=15)


def test_a_drill_cannot_be_mistaken_for_real(there: WebhookServer) -> None:
    alert = pushed(there, rendered_message(kind="drill", severity="alarm", gravest="alarm"))
    assert (alert["labels"]["alertname"], alert["labels"]["real"]) == ("MenshinDrill", "false")
    assert alert["annotations"]["summary"].startswith(f"{DRILL}: ")
    assert alert["annotations"]["description"].startswith("This is a drill.")
