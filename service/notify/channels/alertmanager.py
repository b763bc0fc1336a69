"""How does a letter go to an Alertmanager (Prometheus; API v2)?

An alert there is known by its labels, and forgotten unless it is told again before its end. So what stands is told
again and again with an end a while ahead, as Prometheus itself does, and with an end of now once it is over.
"""

from datetime import datetime, timedelta
from typing import Any

import orjson

from service.notify.addresses import Reach
from service.notify.letter import DRILL, TEST, Addressee, Letter
from service.notify.outbound_http import posted
from service.notify.outcome import Answer
from service.settings import Settings

STANDING = frozenset({"alert", "data"})
"""Kinds that stand until they are over; the others pass by themselves."""
ROUNDS = 4
"""Repetitions that an alert outlives, as Prometheus has it."""
PASSING = timedelta(minutes=15)
"""After which a drill, a test or an earthquake is over."""


def send(letter: Letter, to: Addressee, settings: Settings, now: datetime) -> Answer:
    """Push a letter to an Alertmanager, as an alert that stands or that is over."""
    body = orjson.dumps([alert(letter, timedelta(seconds=settings.notify.alertmanager_interval), now)])
    reach = Reach(settings.notify.allowed_private_hosts, settings.notify.allow_plain_http)
    url = f"{to.address.rstrip('/')}/api/v2/alerts"
    return posted(url, {"Content-Type": "application/json"}, body, reach, settings.notify.timeout)


def alert(letter: Letter, interval: timedelta, now: datetime) -> dict[str, Any]:
    """A letter as an alert of the API.

    Args:
        letter: what is told.
        interval: between two repetitions.
        now: aware time.
    """
    labels = {
        "alertname": f"Menshin{letter.kind.capitalize()}",
        "building": letter.building_code,
        "about": letter.key,
        "severity": letter.gravest,
        "real": "true" if letter.is_real else "false",
    }
    mark = {"drill": f"{DRILL}: ", "test": f"{TEST}: "}.get(letter.kind, "")
    told = {
        "summary": f"{mark}[{letter.building_name}] {letter.subject}",
        "description": "\n".join(letter.paragraphs),
        "message": letter.identity,
    }
    started = letter.began_at if letter.kind in STANDING else letter.written_at
    link = {"generatorURL": letter.link} if letter.link else {}
    return {
        "labels": labels,
        "annotations": told,
        "startsAt": started.isoformat(),
        "endsAt": _end(letter, interval, now).isoformat(),
        **link,
    }


def _end(letter: Letter, interval: timedelta, now: datetime) -> datetime:
    if letter.kind not in STANDING:
        return letter.written_at + PASSING
    return now if letter.is_over else now + ROUNDS * interval
