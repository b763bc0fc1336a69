"""How does a stored message become the letter that goes to a receiver?"""

import os
from collections.abc import Sequence
from datetime import datetime
from zoneinfo import ZoneInfo

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.alerts.tables import Alert
from service.buildings import store as building_store
from service.buildings.recipient_rules import VARIABLE
from service.notify.letter import Addressee, Letter
from service.notify.tables import Delivery, Message, Receiver

SHOWN_TO = frozenset({"email", "apprise"})
"""Kinds of receivers that see the picture."""


class MissingVariableError(Exception):
    """The building file names a variable of the environment that is not there."""


def letter(session: Session, delivery: Delivery, kind: str, public_url: str | None, is_repeat: bool) -> Letter:
    """A message as it goes to a receiver.

    Args:
        session: that reads.
        delivery: of a stored message.
        kind: of the receiver.
        public_url: address at which people reach the pages.
        is_repeat: whether it may be the second of its kind.
    """
    message = delivery.message
    before = _until(session, message)
    timezone = building_store.described(session, message.building).timezone
    since, standing = _standing(session, delivery, ZoneInfo(timezone))
    picture = None
    if kind in SHOWN_TO and message.picture_event_id and message.picture_direction:
        from service.notify import pictures  # what draws takes long to start, and few messages want it

        picture = pictures.loop(session, message.picture_event_id, message.picture_direction, message.kind)
    return Letter(
        identity=message.identity,
        first_identity=before[0].identity,
        key=message.key,
        number=message.number,
        building_code=message.building.code,
        building_name=message.building.name,
        timezone=timezone,
        kind=message.kind,
        sequence=message.sequence,
        severity=message.severity,
        gravest=next((one.severity for one in reversed(before) if not one.is_over), message.severity),
        subject=message.subject,
        sentences=tuple(message.sentences),
        facts=tuple((fact["name"], fact["value"]) for fact in message.facts),
        link=f"{public_url.rstrip('/')}{message.link}" if public_url and message.link else "",
        data=message.data,
        began_at=before[0].created_at,
        written_at=message.created_at,
        is_repeat=is_repeat,
        picture=picture,
        has_ended=message.is_over,
        standing_since=since,
        standing=standing,
    )


def addressee(receiver: Receiver) -> Addressee:
    """Where a receiver is reached, with what the environment holds for it.

    Raises:
        MissingVariableError: it holds nothing under that name.
    """
    secret = None if receiver.secret is None else _meant(receiver.secret)
    return Addressee(receiver.name, receiver.kind, _meant(receiver.address), secret)


def _standing(session: Session, delivery: Delivery, zone: ZoneInfo) -> tuple[datetime | None, str]:
    """Since when what it reports is open, and what a recipient must know who became one after it was written."""
    message = delivery.message
    if delivery.created_at <= message.created_at:
        return None, ""
    numbers = [one["id"] for one in message.data.get("alerts", ())] or [message.data["alert"]]
    every = session.scalars(select(Alert).where(Alert.id.in_(numbers)).order_by(Alert.id)).all()
    began = (
        f"You became a recipient on {_local(delivery.created_at, zone)} ({zone}). "
        f"This was written before that, on {_local(message.created_at, zone)}"
    )
    open_ones = [one for one in every if one.closed_at is None]
    if not open_ones:
        return None, f"{began}, and has ended since."
    states = " ".join(f"Alert {one.id} is {_state(one, zone)}." for one in open_ones)
    return min(one.activated_at or one.opened_at for one in open_ones), f"{began}, and is still open. {states}"


def _state(alert: Alert, zone: ZoneInfo) -> str:
    if alert.acknowledged_by is None or alert.acknowledged_at is None:
        return alert.state.replace("_", " ")
    return f"acknowledged by {alert.acknowledged_by} since {_local(alert.acknowledged_at, zone)}"


def _local(moment: datetime, zone: ZoneInfo) -> str:
    return f"{moment.astimezone(zone):%Y-%m-%d %H:%M}"


def _until(session: Session, message: Message) -> Sequence[Message]:
    """The messages of one key up to this one, in their order."""
    of_key = (Message.building_id == message.building_id, Message.key == message.key)
    question = select(Message).where(*of_key, Message.number <= message.number)
    return session.scalars(question.order_by(Message.number)).all()


def _meant(value: str) -> str:
    if not value.startswith(VARIABLE):
        return value
    name = value.removeprefix(VARIABLE)
    if name not in os.environ:
        raise MissingVariableError(f"the environment has no {name}, which the building file names")
    return os.environ[name]
