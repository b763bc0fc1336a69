"""Which delivery is tried next, by whom, and what became of it?

Claimed under a lease, ended under a fencing token. An attempt is written down before anything is sent; whoever finds
one without an end knows that its message may be out already, and says so with the next.
"""

from dataclasses import dataclass
from datetime import datetime, timedelta
from random import Random

from sqlalchemy import Select, and_, exists, or_, select, update
from sqlalchemy.orm import Session, aliased, joinedload

from service.buildings.recipient_rules import shown_address
from service.db.leases import is_wrong
from service.errors import ConflictError
from service.notify.outcome import Answer
from service.notify.tables import Delivery, DeliveryAttempt, Message

DIED = "The process that sent it ended before the answer came."
OPEN = ("waiting", "sending")


@dataclass(frozen=True, slots=True)
class Patience:
    """How often a delivery is tried, and how far apart."""

    attempts: int
    delay: timedelta
    """Before the second attempt."""
    longest: timedelta
    """Between two attempts."""

    def pause(self, tries: int, rng: Random) -> timedelta:
        """Before the next attempt, after so many: twice as long each time, less by chance, so that not all who wait
        for one server come back at once.

        Exponential backoff with equal jitter (Brooker, Exponential Backoff And Jitter, 2015).
        """
        full = min(self.longest, self.delay * 2.0 ** min(tries - 1, 32))
        return full * rng.uniform(0.5, 1.0)


@dataclass(frozen=True, slots=True)
class Claim:
    """The right to try a delivery, until its lease lapses."""

    delivery_id: int
    token: int
    """How often the delivery had been claimed when this claim was made; the number of the attempt."""
    tries: int
    """Attempts since it was put into the outbox or replayed, with this one."""
    is_repeat: bool
    """Whether an earlier attempt may have reached the receiver."""
    receiver: str
    """Code of the building and name of the receiver."""


def claim(session: Session, now: datetime, lease: timedelta, patience: Patience) -> Claim | None:
    """Take a delivery that is due and that nobody holds, and begin an attempt; None if there is none.

    Messages about one thing reach a receiver in their order: the next waits for the end of the one before.
    """
    while (delivery := session.scalars(_next(now, lease, patience)).one_or_none()) is not None:
        _note_the_dead(session, delivery)
        is_told = delivery.receiver.removed_at is None
        if is_told and delivery.tries < patience.attempts:
            return _begun(session, delivery, now, lease)
        delivery.state = "failed" if is_told else "dropped"
        delivery.claimed_until, delivery.finished_at = None, now
        session.flush()
    return None


def finish(
    session: Session, held: Claim, answer: Answer, seconds: float, now: datetime, patience: Patience, rng: Random
) -> bool:
    """Write what came of an attempt; False if somebody else has taken the delivery over meanwhile."""
    of_attempt = (DeliveryAttempt.delivery_id == held.delivery_id, DeliveryAttempt.number == held.token)
    ended = {"outcome": answer.outcome, "answer": answer.text, "seconds": seconds}
    session.execute(update(DeliveryAttempt).where(*of_attempt).values(**ended))
    if answer.outcome == "delivered":
        return _change(session, held, state="delivered", finished_at=now, kept_at=now)
    if answer.is_final or held.tries >= patience.attempts:
        return _change(session, held, state="failed", finished_at=now)
    return _change(session, held, state="waiting", due_at=now + patience.pause(held.tries, rng))


def replay(delivery: Delivery, now: datetime) -> None:
    """Let a delivery that was given up be tried again, as often as a new one.

    Raises:
        ConflictError: it was not given up, or its receiver is no longer told.
    """
    if delivery.state != "failed":
        raise ConflictError(f"Delivery {delivery.id} is {delivery.state}; only one that has failed is replayed.")
    if delivery.receiver.removed_at is not None:
        raise ConflictError(f"Receiver {delivery.receiver.name!r} is no longer told of the building.")
    delivery.state, delivery.due_at, delivery.finished_at, delivery.tries = "waiting", now, None, 0


def _next(now: datetime, lease: timedelta, patience: Patience) -> Select[Delivery]:
    before, message_before = aliased(Delivery), aliased(Message)
    earlier = (
        exists()
        .where(before.message_id == message_before.id, before.receiver_id == Delivery.receiver_id)
        .where(message_before.building_id == Message.building_id, message_before.key == Message.key)
        .where(message_before.number < Message.number, before.state.in_(OPEN))
    )
    waited = or_(Delivery.due_at <= now, is_wrong(Delivery.due_at, now, patience.longest + lease))
    due = and_(Delivery.state == "waiting", waited)
    silent = or_(Delivery.claimed_until < now, is_wrong(Delivery.claimed_until, now, lease))
    lapsed = and_(Delivery.state == "sending", silent)
    return (
        select(Delivery)
        .join(Delivery.message)
        .options(joinedload(Delivery.receiver, innerjoin=True))
        .where(or_(due, lapsed), ~earlier)
        .order_by(Delivery.due_at, Delivery.id)
        .limit(1)
        .with_for_update(skip_locked=True, of=Delivery)
    )


def _note_the_dead(session: Session, delivery: Delivery) -> None:
    """An attempt without an end, which nobody makes any more, may have reached the receiver."""
    open_ones = (DeliveryAttempt.delivery_id == delivery.id, DeliveryAttempt.outcome.is_(None))
    session.execute(update(DeliveryAttempt).where(*open_ones).values(outcome="unknown", answer=DIED))


def _begun(session: Session, delivery: Delivery, now: datetime, lease: timedelta) -> Claim:
    address = shown_address(delivery.receiver.kind, delivery.receiver.address)
    of_delivery = (DeliveryAttempt.delivery_id == delivery.id, DeliveryAttempt.address == address)
    reached = exists().where(*of_delivery, DeliveryAttempt.outcome != "not_taken")
    is_repeat = bool(session.scalar(select(reached)))
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
    return Claim(delivery.id, delivery.claims, delivery.tries, is_repeat, receiver)


def _change(session: Session, held: Claim, **values: object) -> bool:
    still = (Delivery.id == held.delivery_id, Delivery.claims == held.token, Delivery.state == "sending")
    done = session.scalars(update(Delivery).where(*still).values(claimed_until=None, **values).returning(Delivery.id))
    return done.one_or_none() is not None
