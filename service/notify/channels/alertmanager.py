"""Messages as alerts of an Alertmanager (Prometheus; API v2).

An Alertmanager identifies an alert by its labels, and drops it at its end unless it is sent again. So an open alert is
sent repeatedly with an end in the near future, as Prometheus itself does, and with an end of now once it is over.
"""

from datetime import datetime, timedelta
from typing import Any

import orjson

from service.notify.channels import DeliveryResult
from service.notify.channels.outbound_http import Reach, posted
from service.notify.rendering import Destination, RenderedMessage
from service.settings import Settings

LASTING = frozenset({"alert", "data"})
"""Kinds that last until they are over; the others end by themselves."""
ROUNDS = 4
"""Missed repetitions that an alert survives, as in Prometheus."""
PASSING = timedelta(minutes=15)
"""Duration of a drill, a test or an earthquake."""


def send(message: RenderedMessage, to: Destination, settings: Settings, now: datetime) -> DeliveryResult:
    """Push a message to an Alertmanager, as an open or ended alert."""
    body = orjson.dumps([alert(message, timedelta(seconds=settings.notify.alertmanager_interval), now)])
    reach = Reach(settings.notify.allowed_private_hosts, settings.notify.allow_plain_http)
    url = f"{to.address.rstrip('/')}/api/v2/alerts"
    return posted(url, {"Content-Type": "application/json"}, body, reach, settings.notify.timeout)


def alert(message: RenderedMessage, interval: timedelta, now: datetime) -> dict[str, Any]:
    """A message as an alert of the API.

    Args:
        message: as it is rendered.
        interval: between repetitions.
        now: aware time.
    """
    labels = {
        "alertname": f"Menshin{message.kind.capitalize()}",
        "building": message.building_code,
        "about": message.key,
        "severity": message.gravest,
        "real": "true" if message.is_real else "false",
    }
    annotations = {
        "summary": f"{message.mark}[{message.building_name}] {message.subject}",
        "description": "\n".join(message.paragraphs),
        "message": message.identity,
    }
    started = message.began_at if message.kind in LASTING else message.written_at
    link = {"generatorURL": message.link} if message.link else {}
    return {
        "labels": labels,
        "annotations": annotations,
        "startsAt": started.isoformat(),
        "endsAt": _end(message, interval, now).isoformat(),
        **link,
    }


def _end(message: RenderedMessage, interval: timedelta, now: datetime) -> datetime:
    if message.kind not in LASTING:
        return message.written_at + PASSING
    return now if message.is_over else now + ROUNDS * interval
