"""Drills for all recipients of a building, and tests of one recipient: messages that are not real."""

from datetime import UTC, datetime, timedelta

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.analyses.tables import Analysis, DirectionResult
from service.buildings import recipients
from service.buildings.recipient_rules import Severity
from service.buildings.tables import Building
from service.errors import TooManyRequestsError
from service.notify import texts
from service.notify.outbox import Kind, MessageContent, put_for
from service.notify.tables import Message, Receiver
from service.records.tables import Event

MOST_PER_HOUR = 20
"""Drills and tests of one building: each is a real message to people and a load on a real mail server."""


def drill(session: Session, building: Building, by: str, now: datetime) -> Message:
    """Put a drill into the outbox, as an alarm, for every recipient of the building that is subscribed to drills.

    Args:
        session: of the transaction.
        building: whose recipients get it.
        by: who started the drill.
        now: aware time.

    Raises:
        TooManyRequestsError: the building has had MOST_PER_HOUR drills and tests within an hour.
    """
    _check_rate(session, building.id, now)
    subscribed = [one for one in recipients.of_building(session, building.id) if "drill" in one.kinds]
    sentences = (texts.DRILL_BY.format(by=by), texts.DRILL_CONTENT, texts.DELIVERY_WORKS)
    content = _content(session, building.id, "drill", "alarm", texts.DRILL_SUBJECT, sentences, now)
    return put_for(session, content, subscribed, now)


def trial(session: Session, receiver: Receiver, by: str, now: datetime) -> Message:
    """Put a test into the outbox for this recipient alone, whatever its subscriptions.

    Raises:
        TooManyRequestsError: the building has had MOST_PER_HOUR drills and tests within an hour.
    """
    _check_rate(session, receiver.building_id, now)
    sentences = (texts.TEST_BY.format(by=by, name=receiver.name), texts.DELIVERY_WORKS)
    subject = texts.TEST_SUBJECT.format(name=receiver.name)
    content = _content(session, receiver.building_id, "test", "note", subject, sentences, now)
    return put_for(session, content, [receiver], now)


def _check_rate(session: Session, building_id: int, now: datetime) -> None:
    recent = (
        Message.building_id == building_id,
        Message.kind.in_(("drill", "test")),
        Message.created_at > now - timedelta(hours=1),
    )
    if (session.scalar(select(func.count()).where(*recent)) or 0) >= MOST_PER_HOUR:
        raise TooManyRequestsError(texts.TOO_MANY.format(most=MOST_PER_HOUR))


def _content(
    session: Session,
    building_id: int,
    kind: Kind,
    severity: Severity,
    subject: str,
    sentences: tuple[str, ...],
    now: datetime,
) -> MessageContent:
    return MessageContent(
        key=f"{kind}/{now.astimezone(UTC):%Y%m%dT%H%M%S.%fZ}",
        building_id=building_id,
        kind=kind,
        sequence="new",
        severity=severity,
        subject=subject,
        sentences=sentences,
        picture=_latest_loop(session, building_id),
    )


def _latest_loop(session: Session, building_id: int) -> tuple[int, str] | None:
    """Event and direction of the latest loop: pictures have to arrive too."""
    query = (
        select(Event.id, DirectionResult.direction)
        .join(Analysis, Analysis.event_id == Event.id)
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .where(Event.building_id == building_id, Analysis.current, DirectionResult.displacement.is_not(None))
        .order_by(Event.start.desc(), DirectionResult.direction)
        .limit(1)
    )
    latest = session.execute(query).one_or_none()
    return None if latest is None else (latest[0], latest[1])
