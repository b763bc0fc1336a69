"""How does a letter go to a program? As a CloudEvent, signed as Standard Webhooks says.

CloudEvents 1.0.2, JSON event format (CNCF 2022); Standard Webhooks 1.0.0 (2023), symmetric signatures (v1).
"""

from datetime import datetime
from typing import Any

from cloudevents.core.bindings.http import to_structured_event
from cloudevents.core.v1.event import CloudEvent
from standardwebhooks import Webhook

from service.notify.addresses import Reach
from service.notify.letter import Addressee, Letter
from service.notify.outbound_http import posted
from service.notify.outcome import Answer
from service.settings import Settings
from service.version import VERSION

TYPE = "menshin.{kind}.v1"
"""Of the CloudEvent: `menshin.event.v1`, `menshin.alert.v1`, `menshin.drill.v1` ..."""


def send(letter: Letter, to: Addressee, settings: Settings, now: datetime) -> Answer:
    """Post a letter to a webhook; the bytes that are signed are those that are sent."""
    assert to.secret is not None
    media_type, body = cloud_event(letter)
    headers = {
        "Content-Type": media_type,
        "User-Agent": f"Menshin/{VERSION}",
        "Menshin-Kind": letter.kind,
        "Menshin-Repeat": "true" if letter.is_repeat else "false",
        **signature(letter.identity, body, to.secret, now),
    }
    reach = Reach(settings.notify.allowed_private_hosts, settings.notify.allow_plain_http)
    return posted(to.address, headers, body, reach, settings.notify.timeout)


def signature(identity: str, body: bytes, secret: str, now: datetime) -> dict[str, str]:
    """The headers by which a receiver knows who sent these bytes, and when.

    Args:
        identity: of the message, the same in every attempt.
        body: UTF-8.
        secret: whsec_ and the base64 of the key.
        now: aware time of the attempt.
    """
    return {
        "webhook-id": identity,
        "webhook-timestamp": str(int(now.timestamp())),
        "webhook-signature": Webhook(secret).sign(identity, now, body.decode()),
    }


def cloud_event(letter: Letter) -> tuple[str, bytes]:
    """Media type and bytes of a letter as a CloudEvent."""
    attributes = {
        "specversion": "1.0",
        "id": letter.identity,
        "source": f"/buildings/{letter.building_code}",
        "type": TYPE.format(kind=letter.kind),
        "subject": letter.key,
        "time": letter.written_at,
        "datacontenttype": "application/json",
    }
    message = to_structured_event(CloudEvent(attributes, _data(letter)))
    return message.headers["content-type"], message.body


def _data(letter: Letter) -> dict[str, Any]:
    return {
        "building": letter.building_code,
        "building_name": letter.building_name,
        "kind": letter.kind,
        "is_real": letter.is_real,
        "sequence": letter.sequence,
        "number": letter.number,
        "repeat": letter.is_repeat,
        "standing_since": letter.standing_since and letter.standing_since.isoformat(),
        "severity": letter.severity,
        "is_over": letter.is_over,
        "heading": letter.heading,
        "subject": letter.subject,
        "sentences": list(letter.paragraphs),
        "facts": [{"name": name, "value": value} for name, value in letter.facts],
        "link": letter.link or None,
        "values": dict(letter.data),
    }
