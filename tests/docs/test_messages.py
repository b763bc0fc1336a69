"""The example receiver in docs/operate/messages.md accepts and rejects real messages as documented."""

import re
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

import pytest
from receivers import PostedRequest, webhook_server
from rendered_messages import KEY, rendered_message
from standardwebhooks import WebhookVerificationError

from service.notify.channels.webhook import send
from service.notify.rendering import Destination, RenderedMessage
from service.settings import Settings

DOCUMENT = Path(__file__).resolve().parents[2] / "docs" / "operate" / "messages.md"
Receive = Callable[[Mapping[str, str], bytes, str], str | None]


@pytest.fixture
def receive() -> Receive:
    """The function of the page."""
    [code] = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text("utf-8"), re.DOTALL)
    names: dict[str, Receive] = {}
    exec(code, names)
    return names["receive"]


def sent(one: RenderedMessage) -> PostedRequest:
    with webhook_server() as server:
        settings = Settings(inside_allowed=("localhost",), plain_http_allowed=True)
        send(one, Destination("program", "webhook", server.address, KEY), settings, datetime.now(UTC))
        return server.posted[0]


def test_the_example_takes_what_is_ours_once_and_nothing_else(receive: Receive) -> None:
    first, again = sent(rendered_message()), sent(rendered_message(is_repeat=True))
    assert receive(first.headers, first.body, KEY) == rendered_message().heading
    assert receive(again.headers, again.body, KEY) is None, "it has it already"
    with pytest.raises(WebhookVerificationError):
        receive(first.headers, first.body.replace(b"31 mm", b"13 mm"), KEY)


def test_the_example_knows_a_drill(receive: Receive) -> None:
    drill = sent(rendered_message(identity="msg_3", kind="drill"))
    assert receive(drill.headers, drill.body, KEY) == "a drill, nothing to be done"
