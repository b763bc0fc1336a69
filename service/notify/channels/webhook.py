"""Messages to programs: a CloudEvent, signed by the rules of Standard Webhooks.

CloudEvents 1.0.2, JSON event format (CNCF 2022); Standard Webhooks 1.0.0 (2023), symmetric signatures (v1).
"""

from datetime import datetime
from typing import Any

from cloudevents.core.bindings.http import to_structured_event
from cloudevents.core.v1.event import CloudEvent
from standardwebhooks import Webhook

from service.notify.channels import DeliveryResult
from service.notify.channels.outbound_http import Reach, posted
from service.notify.rendering import Destination, RenderedMessage
from service.settings import Settings
from service.version import VERSION

TYPE = "menshin.{kind}.v1"
"""Type of the CloudEvent: `menshin.event.v1`, `menshin.alert.v1`, `menshin.drill.v1` ..."""


def send(message: RenderedMessage, to: Destination, settings: Settings, now: datetime) -> DeliveryResult:
    """Post a message to a webhook; the signature is of the bytes that are sent."""
    assert to.secret is not None
    media_type, body = cloud_event(message)
    headers = {
        "Content-Type": media_type,
        "User-Agent": f"Menshin/{VERSION}",
        "Menshin-Kind": message.kind,
        "Menshin-Repeat": "true" if message.is_repeat else "false",
        **signature(message.identity, body, to.secret, now),
    }
    reach = Reach(settings.notify.allowed_private_hosts, settings.notify.allow_plain_http)
    return posted(to.address, headers, body, reach, settings.notify.timeout)


def signature(identity: str, body: bytes, secret: str, now: datetime) -> dict[str, str]:
    """The headers by which a recipient verifies the sender and the time of these bytes.

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


def cloud_event(message: RenderedMessage) -> tuple[str, bytes]:
    """Media type and bytes of a message as a CloudEvent."""
    attributes = {
        "specversion": "1.0",
        "id": message.identity,
        "source": f"/buildings/{message.building_code}",
        "type": TYPE.format(kind=message.kind),
        "subject": message.key,
        "time": message.written_at,
        "datacontenttype": "application/json",
    }
    event = to_structured_event(CloudEvent(attributes, _data(message)))
    return event.headers["content-type"], event.body


def _data(message: RenderedMessage) -> dict[str, Any]:
    return {
        "building": message.building_code,
        "building_name": message.building_name,
        "kind": message.kind,
        "is_real": message.is_real,
        "sequence": message.sequence,
        "number": message.number,
        "repeat": message.is_repeat,
        "standing_since": message.active_since and message.active_since.isoformat(),
        "severity": message.severity,
        "is_over": message.is_over,
        "heading": message.heading,
        "subject": message.subject,
        "sentences": list(message.paragraphs),
        "facts": [{"name": name, "value": value} for name, value in message.facts],
        "link": message.link or None,
        "values": dict(message.data),
    }
