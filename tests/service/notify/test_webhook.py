"""Webhooks: the published signatures, the published form, and the very bytes that were signed."""

import base64
import json
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from cloudevents.core.bindings.http import HTTPMessage, from_structured_event
from hypothesis import given, strategies as st
from receivers import PostedRequest, WebhookServer, webhook_server
from rendered_messages import KEY, WRITTEN, rendered_message
from standardwebhooks import Webhook, WebhookVerificationError

from service.notify.channels.webhook import cloud_event, send, signature
from service.notify.rendering import Destination, RenderedMessage
from service.settings import Settings

SETTINGS = Settings(inside_allowed=("localhost",), plain_http_allowed=True)


@pytest.fixture
def there() -> Iterator[WebhookServer]:
    with webhook_server() as server:
        yield server


def received(there: WebhookServer, one: RenderedMessage) -> PostedRequest:
    answer = send(one, Destination("program", "webhook", there.address, KEY), SETTINGS, datetime.now(UTC))
    assert answer.outcome == "delivered"
    return there.posted[-1]


def test_the_published_signatures() -> None:
    """Test vector of the Standard Webhooks reference libraries (github.com/standard-webhooks, test_webhook)."""
    headers = signature(
        "msg_p5jXN8AQM9LWM0D4loKWxJek",
        b'{"test": 2432232314}',
        "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw",
        datetime.fromtimestamp(1614265330, UTC),
    )
    assert headers == {
        "webhook-id": "msg_p5jXN8AQM9LWM0D4loKWxJek",
        "webhook-timestamp": "1614265330",
        "webhook-signature": "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=",
    }


@given(printed=st.text(), key=st.binary(min_size=24, max_size=64))
def test_a_receiver_can_check_any_bytes(printed: str, key: bytes) -> None:
    secret = "whsec_" + base64.b64encode(key).decode()
    _, body = cloud_event(rendered_message(sentences=(printed,)))
    headers = signature("msg_1", body, secret, datetime.now(UTC))
    assert Webhook(secret).verify(body, headers)["data"]["sentences"] == [printed]


def test_what_arrives_is_what_was_signed(there: WebhookServer) -> None:
    one = received(there, rendered_message())
    assert Webhook(KEY).verify(one.body, dict(one.headers))["id"] == "msg_2"
    for change in (one.body.replace(b"31 mm", b"13 mm"), one.body + b" "):
        with pytest.raises(WebhookVerificationError):
            Webhook(KEY).verify(change, dict(one.headers))
    with pytest.raises(WebhookVerificationError):
        Webhook(KEY.replace("A", "B")).verify(one.body, dict(one.headers))


def test_it_is_a_cloud_event(there: WebhookServer) -> None:
    one = received(there, rendered_message())
    assert one.headers["content-type"] == "application/cloudevents+json"
    event = from_structured_event(HTTPMessage(dict(one.headers), one.body))
    assert event.get_specversion() == "1.0"
    assert event.get_type() == "menshin.event.v1"
    assert event.get_source() == "/buildings/TOWER"
    assert event.get_subject() == "event/17"
    assert event.get_time() == WRITTEN
    data = event.get_data()
    assert isinstance(data, dict)
    assert data["values"] == {"peak_displacement": 0.031}
    assert data["facts"][0] == {"name": "Largest displacement", "value": "31 mm"}
    assert (data["severity"], data["is_real"], data["is_over"], data["repeat"]) == ("normal", True, False, False)


def test_a_repeat_is_marked_and_keeps_its_id(there: WebhookServer) -> None:
    first, again = received(there, rendered_message()), received(there, rendered_message(is_repeat=True))
    assert first.headers["webhook-id"] == again.headers["webhook-id"] == "msg_2"
    assert (first.headers["menshin-repeat"], again.headers["menshin-repeat"]) == ("false", "true")
    assert json.loads(again.body)["data"]["repeat"] is True


def test_a_drill_cannot_be_mistaken_for_real(there: WebhookServer) -> None:
    one = received(there, rendered_message(kind="drill", severity="alarm"))
    event = json.loads(one.body)
    assert event["type"] == "menshin.drill.v1"
    assert event["data"]["is_real"] is False
    assert event["data"]["sentences"][0].startswith("This is a drill.")
    assert one.headers["menshin-kind"] == "drill"


def test_nothing_goes_inside_unless_it_is_allowed(there: WebhookServer) -> None:
    shut = Settings(plain_http_allowed=True)
    answer = send(rendered_message(), Destination("program", "webhook", there.address, KEY), shut, datetime.now(UTC))
    assert (answer.outcome, there.posted) == ("not_taken", [])
    assert KEY not in repr(replace(Destination("program", "webhook", there.address, KEY)))
