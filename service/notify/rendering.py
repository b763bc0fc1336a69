"""A stored message rendered for one recipient: subject line, paragraphs, facts, picture and address."""

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any
from unicodedata import east_asian_width
from zoneinfo import ZoneInfo

from sqlalchemy import select
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session

from service.alerts.tables import Alert
from service.analyses import queries as analysis_queries
from service.buildings import store as building_store
from service.buildings.recipient_rules import VARIABLE
from service.errors import NotFoundError
from service.language.translation import said
from service.notify import texts
from service.notify.tables import Message, Receiver

log = logging.getLogger(__name__)

WITH_PICTURE = frozenset({"email", "apprise"})
"""Kinds of recipients that see the picture."""
SCALE = 2.0
"""Pixels of the picture per pixel of the chart, for high-density screens."""


class MissingVariableError(Exception):
    """The building file names an environment variable that is not set."""


@dataclass(frozen=True, slots=True)
class Attachment:
    """A file of a mail."""

    name: str
    content: bytes = field(repr=False)
    """PDF."""


@dataclass(frozen=True, slots=True)
class RenderedMessage:
    """A message for one recipient, in one attempt, and in the language that is spoken while it is made and read."""

    identity: str
    first_identity: str
    """Identity of the first message of its key."""
    key: str
    number: int
    building_code: str
    building_name: str
    timezone: str
    """IANA name."""
    kind: str
    sequence: str
    severity: str
    gravest: str
    """Severity by which programs identify the thread: that of its last message that was not over."""
    subject: str
    sentences: tuple[str, ...]
    facts: tuple[tuple[str, str], ...]
    link: str
    """Address of the page with the details; empty where the address of the pages is not set."""
    data: Mapping[str, Any]
    began_at: datetime
    """Time of the first message of its key."""
    written_at: datetime
    is_repeat: bool
    """True if an earlier attempt may have arrived."""
    picture: bytes | None = None
    """PNG."""
    has_ended: bool = False
    """True if what it reports had ended when it was written."""
    active_since: datetime | None = None
    """For a recipient added after it was written: when the open alert that it reports began; None otherwise."""
    note: str = ""
    """Note to that recipient; empty otherwise."""
    report: Attachment | None = None
    """The report on the earthquake, for recipients of mail who get it."""

    @property
    def is_over(self) -> bool:
        """True if what it reports no longer holds."""
        return self.has_ended or self.sequence == "cancelled"

    @property
    def is_real(self) -> bool:
        """True if it is about the building; a drill or a test is not."""
        return self.kind not in texts.NOT_REAL

    @property
    def mark(self) -> str:
        """`DRILL – NOT REAL: ` before the subject of a drill; empty if it is real."""
        return "" if self.is_real else f"{said(texts.MARKS[self.kind])}: "

    @property
    def heading(self) -> str:
        """The subject line, marks first."""
        resent = f"({said(texts.RESENT)}) " if self.is_repeat else ""
        return f"{resent}{self.mark}{self.order}[{self.building_name}] {' '.join(self.subject.split())}"

    @property
    def order(self) -> str:
        """Its relation to earlier messages, before the subject."""
        order = texts.SEQUENCES[self.sequence]
        if self.active_since is not None:
            order = texts.OPEN_SINCE.format(since=self.active_since.astimezone(ZoneInfo(self.timezone)))
        return f"{said(order)}: " if order else ""

    @property
    def paragraphs(self) -> tuple[str, ...]:
        """All paragraphs, notes first."""
        before = (said(texts.NOT_REAL.get(self.kind, "")), self.note)
        after = (said(texts.MAY_BE_SECOND),) if self.is_repeat else ()
        return (*filter(None, before), *self.sentences, *after)

    @property
    def written(self) -> str:
        """Time of writing, in the building's time zone."""
        local = self.written_at.astimezone(ZoneInfo(self.timezone))
        return f"{local:%Y-%m-%d %H:%M:%S} ({self.timezone})"

    @property
    def text(self) -> str:
        """All of it as plain text."""
        widest = max((_width(name) for name, _ in self.facts), default=0)
        facts = "\n".join(f"{name}{' ' * (widest - _width(name))}  {value}" for name, value in self.facts)
        more = said(texts.LINK.format(link=self.link)) if self.link else ""
        footer = said(texts.FOOTER.format(written=self.written, identity=self.identity))
        return "\n\n".join(part for part in (*self.paragraphs, facts, more, footer) if part) + "\n"


def _width(text: str) -> int:
    """Columns of a text in a font of one width, where East Asian characters take two."""
    return sum(2 if east_asian_width(character) in "FW" else 1 for character in text)


@dataclass(frozen=True, slots=True)
class Destination:
    """Name and address of a recipient, with secrets; never shown."""

    name: str
    kind: str
    address: str = field(repr=False)
    secret: str | None = field(repr=False)


def rendered(
    session: Session, message: Message, queued_at: datetime, kind: str, public_url: str | None, *, is_repeat: bool
) -> RenderedMessage:
    """A stored message for a recipient, in the language that is spoken.

    Args:
        session: to read with.
        message: stored.
        queued_at: creation of the delivery to the recipient, later than the message for one added afterwards.
        kind: of the recipient.
        public_url: address of the pages.
        is_repeat: whether an earlier attempt may have arrived.
    """
    thread = _thread(session, message)
    timezone = building_store.described(session, message.building).timezone
    since, note = _new_recipient_note(session, message, queued_at, ZoneInfo(timezone))
    return RenderedMessage(
        identity=message.identity,
        first_identity=thread[0].identity,
        key=message.key,
        number=message.number,
        building_code=message.building.code,
        building_name=message.building.name,
        timezone=timezone,
        kind=message.kind,
        sequence=message.sequence,
        severity=message.severity,
        gravest=next((one.severity for one in reversed(thread) if not one.is_over), message.severity),
        subject=said(message.subject),
        sentences=tuple(said(sentence) for sentence in message.sentences),
        facts=tuple((said(fact["name"]), said(fact["value"])) for fact in message.facts),
        link=f"{public_url.rstrip('/')}{message.link}" if public_url and message.link else "",
        data=message.data,
        began_at=thread[0].created_at,
        written_at=message.created_at,
        is_repeat=is_repeat,
        picture=_picture(session, message) if kind in WITH_PICTURE else None,
        has_ended=message.is_over,
        active_since=since,
        note=said(note),
    )


def with_report(session: Session, message: Message, shown: RenderedMessage, now: datetime) -> RenderedMessage:
    """The same with the report on its earthquake; a drill's or a test's is stamped, and of an earlier one.

    A message that was written while it shook has none: there is no result yet.

    Args:
        session: to read with.
        message: stored.
        shown: the same, rendered.
        now: time of the report.
    """
    about, _, number = message.key.partition("/")
    event_id = int(number) if about == "event" else message.picture_event_id
    if event_id is None or (about != "event" and shown.is_real) or message.data.get("is_provisional", False):
        return shown
    from service.reports import earthquake, pictures, rendering  # slow to import, and few messages need them

    try:
        report = earthquake.earthquake_report(session, event_id, texts.MARKS.get(message.kind, ""))
        content = rendering.pdf(report, pictures.pictures(session, report), now)
    except OperationalError:  # all of it waits for the database
        raise
    except Exception:  # the message is more important than its attachment
        log.exception("the report on event %d could not be made", event_id)
        return replace(shown, note=" ".join(filter(None, (shown.note, said(texts.NO_REPORT)))))
    return replace(shown, report=Attachment(rendering.file_name(report, "pdf"), content))


def destination(receiver: Receiver) -> Destination:
    """Address of a recipient, with the values of environment variables that the building file names.

    Raises:
        MissingVariableError: one of them is not set.
    """
    secret = None if receiver.secret is None else _resolved(receiver.secret)
    return Destination(receiver.name, receiver.kind, _resolved(receiver.address), secret)


def _resolved(value: str) -> str:
    if not value.startswith(VARIABLE):
        return value
    name = value.removeprefix(VARIABLE)
    if name not in os.environ:
        raise MissingVariableError(f"the environment has no {name}, which the building file names")
    return os.environ[name]


def _thread(session: Session, message: Message) -> Sequence[Message]:
    """The messages of its key up to this one, in order."""
    of_key = (Message.building_id == message.building_id, Message.key == message.key)
    query = select(Message).where(*of_key, Message.number <= message.number)
    return session.scalars(query.order_by(Message.number)).all()


def _new_recipient_note(
    session: Session, message: Message, queued_at: datetime, zone: ZoneInfo
) -> tuple[datetime | None, str]:
    """For a recipient added after the message was written: since when its alerts are open, and a note about that."""
    if queued_at <= message.created_at:
        return None, ""
    numbers = [one["id"] for one in message.data.get("alerts", ())] or [message.data["alert"]]
    alerts = session.scalars(select(Alert).where(Alert.id.in_(numbers)).order_by(Alert.id)).all()
    since, written = _local(queued_at, zone), _local(message.created_at, zone)
    values = {"since": since, "zone": zone, "written": written}
    open_alerts = [one for one in alerts if one.closed_at is None]
    if not open_alerts:
        return None, texts.HAS_ENDED.format(**values)
    states = " ".join(texts.ALERT_STATE.format(id=one.id, state=_state(one, zone)) for one in open_alerts)
    first = min(one.activated_at or one.opened_at for one in open_alerts)
    return first, texts.STILL_OPEN.format(**values, states=states)


def _state(alert: Alert, zone: ZoneInfo) -> str:
    if alert.acknowledged_by is None or alert.acknowledged_at is None:
        return alert.state.replace("_", " ")
    return texts.ACKNOWLEDGED.format(by=alert.acknowledged_by, at=_local(alert.acknowledged_at, zone))


def _local(moment: datetime, zone: ZoneInfo) -> str:
    return f"{moment.astimezone(zone):%Y-%m-%d %H:%M}"


def _picture(session: Session, message: Message) -> bytes | None:
    """Hysteresis loop of the isolation layer in the message's event, by its latest analysis, as PNG.

    Returns:
        None where the message has no picture, or the result or its displacement does not exist.
    """
    if not message.picture_event_id or not message.picture_direction:
        return None
    import numpy as np  # slow to import, as the others, and few messages need them

    from service.db.blobs import decode_history
    from service.documents import charts, still

    try:
        result = analysis_queries.restoring_force(session, message.picture_event_id, message.picture_direction, None)
        rate, displacement, force, _ = analysis_queries.loop(session, result.id)
    except NotFoundError:
        return None
    displacement, force = decode_history(displacement), decode_history(force)
    mark = texts.MARKS.get(message.kind)
    picture = charts.loop(
        time=np.arange(force.size) / rate,
        displacement=displacement,
        force=force,
        title=said(texts.PICTURE_TITLE.format(direction=message.picture_direction)),
        subtitle="" if mark is None else said(texts.PICTURE_MARK.format(mark=mark)),
    )
    return still.png(picture.to_dict(), SCALE)
