"""Claims of deliveries: the next one due is claimed under a lease, and finished under a fencing token.

An attempt is stored before anything is sent. An attempt without a result may have arrived, and the next one says so.
"""

from dataclasses import dataclass
from datetime import datetime, timedelta
from random import Random

from sqlalchemy import Select, and_, case, delete, exists, or_, select, update
from sqlalchemy.orm import Session, aliased, joinedload

from service.buildings.recipient_rules import SEVERITIES, shown_address
from service.db.process_leases import is_wrong
from service.errors import ConflictError
from service.language.choice import ENGLISH, Language, known
from service.notify import texts
from service.notify.channels import DeliveryResult
from service.notify.tables import Delivery, DeliveryAttempt, Message

OPEN = ("waiting", "sending")
"""States of deliveries that have not ended."""
URGENCY = {severity: place for place, severity in enumerate(reversed(SEVERITIES))}
"""Place of a message among those that are due, by its severity."""


@dataclass(frozen=True, slots=True)
class RetryPolicy:
    """Number of attempts at a delivery, and the pauses between them."""

    attempts: int
    delay: timedelta
    """Pause before the second attempt."""
    longest: timedelta
    """Longest pause."""

    def pause(self, failures: int, rng: Random) -> timedelta:
        """Pause after this many attempts that failed: doubled each time, less a random part, so that not all deliveries
        to one server come back at once.

        Exponential backoff with equal jitter (Brooker, Exponential Backoff And Jitter, 2015).
        """
        full = min(self.longest, self.delay * 2.0 ** min(failures - 1, 32))
        return full * rng.uniform(0.5, 1.0)


@dataclass(frozen=True, slots=True)
class Claim:
    """The right to attempt a delivery, until its lease lapses."""

    delivery_id: int
    token: int
    """Fencing token: number of the claim, and of the attempt."""
    tries: int
    """Attempts since it was put into the outbox or replayed, this one included."""
    lost: int
    """Number of them whose process died: they say nothing of the recipient."""
    is_repeat: bool
    """True if an earlier attempt may have arrived."""
    receiver: str
    """Code of the building and name of the recipient."""
    language: Language
    """In which the recipient gets messages."""

    @property
    def failures(self) -> int:
        """Attempts that have failed if this one fails too, without those whose process died."""
        return max(1, self.tries - self.lost)


def claim(session: Session, now: datetime, lease: timedelta, policy: RetryPolicy) -> Claim | None:
    """Claim a due delivery and begin an attempt, of an alarm before all others; None if there is none.

    Messages of one key reach a recipient in order: each waits for the end of the one before.
    """
    while (delivery := session.scalars(_next(now, lease, policy)).one_or_none()) is not None:
        _end_lost_attempts(session, delivery)
        is_there = delivery.receiver.removed_at is None
        if is_there and delivery.tries < policy.attempts:
            return _begun(session, delivery, now, lease)
        delivery.state = "failed" if is_there else "dropped"
        delivery.claimed_until, delivery.finished_at = None, now
        session.flush()
    return None


def finish(
    session: Session,
    claimed: Claim,
    result: DeliveryResult,
    seconds: float,
    now: datetime,
    policy: RetryPolicy,
    rng: Random,
) -> bool:
    """Store the result of an attempt; False if another notifier has claimed the delivery meanwhile."""
    if result.outcome == "delivered":
        is_stored = _change(session, claimed, state="delivered", finished_at=now, kept_at=now)
    elif result.is_final or claimed.tries >= policy.attempts:
        is_stored = _change(session, claimed, state="failed", finished_at=now)
    else:
        is_stored = _change(session, claimed, state="waiting", due_at=now + policy.pause(claimed.failures, rng))
    of_attempt = (DeliveryAttempt.delivery_id == claimed.delivery_id, DeliveryAttempt.number == claimed.token)
    ended = {"outcome": result.outcome, "answer": result.text, "seconds": seconds}
    session.execute(update(DeliveryAttempt).where(*of_attempt).values(**ended))  # after the delivery, as `claim`
    return is_stored


def withdraw(session: Session, claimed: Claim) -> bool:
    """Undo a claim under which nothing was sent: it is no attempt. False if another notifier has the delivery."""
    if not _change(session, claimed, state="waiting", tries=Delivery.tries - 1):
        return False
    of_attempt = (DeliveryAttempt.delivery_id == claimed.delivery_id, DeliveryAttempt.number == claimed.token)
    session.execute(delete(DeliveryAttempt).where(*of_attempt))
    return True


def replay(delivery: Delivery, now: datetime) -> None:
    """Try a failed delivery again, as often as a new one.

    Raises:
        ConflictError: it has not failed, or its recipient was removed.
    """
    if delivery.state != "failed":
        raise ConflictError(f"Delivery {delivery.id} is {delivery.state}; only a failed delivery can be replayed.")
    if delivery.receiver.removed_at is not None:
        raise ConflictError(f"Receiver {delivery.receiver.name!r} was removed from the building.")
    delivery.state, delivery.due_at, delivery.finished_at, delivery.tries = "waiting", now, None, 0


def _next(now: datetime, lease: timedelta, policy: RetryPolicy) -> Select[Delivery]:
    before, message_before = aliased(Delivery), aliased(Message)
    earlier = (
        exists()
        .where(before.message_id == message_before.id, before.receiver_id == Delivery.receiver_id)
        .where(message_before.building_id == Message.building_id, message_before.key == Message.key)
        .where(message_before.number < Message.number, before.state.in_(OPEN))
    )
    waited = or_(Delivery.due_at <= now, is_wrong(Delivery.due_at, now, policy.longest + lease))
    due = and_(Delivery.state == "waiting", waited)
    silent = or_(Delivery.claimed_until < now, is_wrong(Delivery.claimed_until, now, lease))
    lapsed = and_(Delivery.state == "sending", silent)
    return (
        select(Delivery)
        .join(Delivery.message)
        .options(joinedload(Delivery.receiver, innerjoin=True))
        .where(or_(due, lapsed), ~earlier)
        .order_by(case(URGENCY, value=Message.severity), Delivery.due_at, Delivery.id)
        .limit(1)
        .with_for_update(skip_locked=True, of=Delivery)
    )


def _end_lost_attempts(session: Session, delivery: Delivery) -> None:
    """Attempts whose process died have an unknown result: they may have arrived."""
    without_result = (DeliveryAttempt.delivery_id == delivery.id, DeliveryAttempt.outcome.is_(None))
    session.execute(update(DeliveryAttempt).where(*without_result).values(outcome="unknown", answer=texts.PROCESS_DIED))


def _begun(session: Session, delivery: Delivery, now: datetime, lease: timedelta) -> Claim:
    address = shown_address(delivery.receiver.kind, delivery.receiver.address)
    of_delivery = (DeliveryAttempt.delivery_id == delivery.id, DeliveryAttempt.address == address)
    reached = exists().where(*of_delivery, DeliveryAttempt.outcome != "not_taken")
    is_repeat = bool(session.scalar(select(reached)))
    answers = select(DeliveryAttempt.answer).where(DeliveryAttempt.delivery_id == delivery.id)
    latest = session.scalars(answers.order_by(DeliveryAttempt.number.desc()).limit(delivery.tries)).all()
    lost = latest.count(texts.PROCESS_DIED)
    delivery.state, delivery.claimed_until = "sending", now + lease
    delivery.claims, delivery.tries = delivery.claims + 1, delivery.tries + 1
    session.add(
        DeliveryAttempt(
            delivery_id=delivery.id,
            number=delivery.claims,
            is_repeat=is_repeat,
            address=address,
            begun_at=now,
        )
    )
    session.flush()
    receiver = f"{delivery.receiver.building.code}/{delivery.receiver.name}"
    language = known(delivery.receiver.language) or ENGLISH
    return Claim(delivery.id, delivery.claims, delivery.tries, lost, is_repeat, receiver, language)


def _change(session: Session, claimed: Claim, **values: object) -> bool:
    still = (Delivery.id == claimed.delivery_id, Delivery.claims == claimed.token, Delivery.state == "sending")
    done = session.scalars(update(Delivery).where(*still).values(claimed_until=None, **values).returning(Delivery.id))
    return done.one_or_none() is not None
