"""Chat services through Apprise, in the real process, which must not reach inside."""

import json
from base64 import b64decode
from collections.abc import Iterator
from datetime import UTC, datetime

import pytest
from receivers import WebhookServer, webhook_server
from rendered_messages import rendered_message

from service.notify.channels import DeliveryResult
from service.notify.channels.chat import send
from service.notify.rendering import Destination, RenderedMessage
from service.notify.texts import DRILL
from service.settings import Settings

NOW = datetime(2024, 3, 1, tzinfo=UTC)
OPEN = Settings(inside_allowed=("127.0.0.0/8",))


@pytest.fixture
def there() -> Iterator[WebhookServer]:
    with webhook_server() as server:
        server.status = 200
        yield server


def sent(address: str, one: RenderedMessage | None = None, settings: Settings = OPEN) -> DeliveryResult:
    return send(one or rendered_message(), Destination("chat", "apprise", address, None), settings, NOW)


def chat(there: WebhookServer) -> str:
    """A recipient at Apprise's own JSON service, which posts as a chat service does."""
    return there.address.replace("http://", "json://").replace("localhost", "127.0.0.1")


def test_a_letter_arrives_with_its_heading(there: WebhookServer) -> None:
    one = rendered_message(kind="drill", is_repeat=True, severity="alarm")
    assert sent(chat(there), one).outcome == "delivered"
    printed = json.loads(there.posted[0].body)
    assert printed["title"] == one.heading
    assert printed["title"].startswith(f"(repeat) {DRILL}: ")
    assert "This does not replace an inspection." in printed["message"]
    assert printed["type"] == "failure"


def test_the_picture_goes_where_the_service_takes_one(there: WebhookServer) -> None:
    picture = b"\x89PNG and so on" * 10_000
    assert sent(chat(there), rendered_message(picture=picture)).outcome == "delivered"
    [attached] = json.loads(there.posted[0].body)["attachments"]
    assert (attached["filename"], attached["mimetype"]) == ("loop.png", "image/png")
    assert b64decode(attached["base64"]) == picture
    plain = there.address.replace("http://localhost", "gotify://127.0.0.1") + "/AaBbCcDdEeFfGgH"
    assert sent(plain, rendered_message(picture=picture)).outcome == "delivered"
    assert "This does not replace an inspection." in there.posted[1].body.decode()
    assert len(there.posted[1].body) < len(picture)


def test_a_repeat_goes_without_the_picture_for_it_may_have_been_refused(there: WebhookServer) -> None:
    assert sent(chat(there), rendered_message(picture=b"\x89PNG", is_repeat=True)).outcome == "delivered"
    printed = json.loads(there.posted[0].body)
    assert printed["attachments"] == []
    assert printed["title"].startswith("(repeat) ")


def test_a_picture_leads_no_further_inside(there: WebhookServer) -> None:
    answer = sent(chat(there), rendered_message(picture=b"\x89PNG"), settings=Settings())
    assert (answer.outcome, there.posted) == ("not_taken", [])


def test_a_refused_message_may_have_been_delivered(there: WebhookServer) -> None:
    there.status = 500
    answer = sent(chat(there))
    assert answer.outcome == "unknown"
    assert "500" in answer.text
    assert str(there.address.rpartition(":")[2]) not in answer.text


def test_it_reaches_nothing_inside(there: WebhookServer) -> None:
    answer = sent(chat(there), settings=Settings())
    assert (answer.outcome, there.posted) == ("not_taken", [])
    assert "127.0.0.1" in answer.text


def test_no_redirect_leads_inside(there: WebhookServer) -> None:
    with webhook_server() as inside:
        there.status, there.headers = 307, {"Location": inside.address.replace("localhost", "127.0.0.2")}
        answer = sent(chat(there), settings=Settings(inside_allowed=("127.0.0.1",)))
        assert inside.posted == []
    assert answer.outcome == "not_taken"


@pytest.mark.parametrize("address", ["nonsense://token-of-ours", "slack://token-of-ours"])
def test_an_address_that_is_none_is_reported_as_and_not_repeated(address: str) -> None:
    answer = sent(address)
    assert (answer.outcome, answer.is_final) == ("not_taken", True)
    assert "token-of-ours" not in answer.text


def test_nothing_is_done_on_this_machine() -> None:
    answer = sent("syslog://")
    assert (answer.outcome, "syslog" in answer.text) == ("not_taken", True)
