"""What is sent that is not real? Drills to everybody, and a test to one receiver."""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from service.analyses.tables import Analysis, DirectionResult
from service.buildings import recipients
from service.buildings.recipient_rules import Severity
from service.buildings.tables import Building
from service.errors import TooManyRequestsError
from service.notify.notice import Kind, Notice
from service.notify.outbox import put_for
from service.notify.tables import Message, Receiver
from service.records.tables import Event

MOST_PER_HOUR = 20
"""Drills and tests of one building: each is a real message to people, and costs a real mail server's patience."""
INSTEAD = (
    "Had it been real, you would read here what happened, how far the isolators moved, and whether anything unusual "
    "was seen.",
    "If you can read this, the way of the messages to you works.",
)


def drill(session: Session, building: Building, by: str, now: datetime) -> Message:
    """Put a drill into the outbox, as an alarm, for every receiver of the building that wants drills.

    Args:
        session: of the transaction.
        building: whose receivers are told.
        by: who holds the drill.
        now: aware time.

    Raises:
        TooManyRequestsError: the building has had MOST_PER_HOUR drills and tests within an hour.
    """
    _check_rate(session, building.id, now)
    told = [one for one in recipients.of_building(session, building.id) if "drill" in one.kinds]
    said = (f"{by} holds this drill.", *INSTEAD)
    subject = "An alarm, as a drill"
    return put_for(session, _notice(session, building.id, "drill", "alarm", subject, said, now), told, now)


def trial(session: Session, receiver: Receiver, by: str, now: datetime) -> Message:
    """Put a test into the outbox, for this receiver alone, whatever it wants to hear of.

    Raises:
        TooManyRequestsError: the building has had MOST_PER_HOUR drills and tests within an hour.
    """
    _check_rate(session, receiver.building_id, now)
    said = (f"{by} asked for this test of {receiver.name}.", INSTEAD[-1])
    notice = _notice(session, receiver.building_id, "test", "note", f"A test of {receiver.name}", said, now)
    return put_for(session, notice, [receiver], now)


def _check_rate(session: Session, building_id: int, now: datetime) -> None:
    recent = (
        Message.building_id == building_id,
        Message.kind.in_(("drill", "test")),
        Message.created_at > now - timedelta(hours=1),
    )
    if (session.scalar(select(func.count()).where(*recent)) or 0) >= MOST_PER_HOUR:
        raise TooManyRequestsError(
            f"{MOST_PER_HOUR} drills and tests were sent for this building within the last hour, the most that are "
            "allowed. Try again later."
        )


def _notice(
    session: Session, building_id: int, kind: Kind, severity: Severity, subject: str, said: Sequence[str], now: datetime
) -> Notice:
    return Notice(
        key=f"{kind}/{now.astimezone(UTC):%Y%m%dT%H%M%S.%fZ}",
        building_id=building_id,
        kind=kind,
        sequence="new",
        severity=severity,
        subject=subject,
        sentences=tuple(said),
        picture=_latest_loop(session, building_id),
    )


def _latest_loop(session: Session, building_id: int) -> tuple[int, str] | None:
    """Event and direction of the latest loop there is: a picture must find its way too."""
    question = (
        select(Event.id, DirectionResult.direction)
        .join(Analysis, Analysis.event_id == Event.id)
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .where(Event.building_id == building_id, Analysis.current, DirectionResult.displacement.is_not(None))
        .order_by(Event.start.desc(), DirectionResult.direction)
        .limit(1)
    )
    found = session.execute(question).one_or_none()
    return None if found is None else (found[0], found[1])
