"""Sends what is in the outbox: claims a delivery, sends outside any transaction, writes what came of it."""

import logging
from collections.abc import Callable, Collection
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from random import Random
from threading import Event as Signal
from time import monotonic

from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service.db.problems import Attempts
from service.db.sessions import reading
from service.notify import claims, writing
from service.notify.channels.senders import SENDERS
from service.notify.claims import Claim, Patience
from service.notify.housekeeping import Upkeep
from service.notify.outcome import Answer
from service.notify.tables import Delivery
from service.notify.writing import MissingVariableError
from service.settings import Settings

log = logging.getLogger(__name__)

IDLE = 0.5
"""s between two looks at the outbox."""
AT_ONCE = 8
"""Deliveries under way together, so that one slow receiver holds up no other."""
SPARE = timedelta(seconds=60)
"""That a lease outlasts the longest attempt: for the picture, and for a busy machine."""


@dataclass(slots=True)
class Notifier:
    """Delivers until it is told to stop.

    A delivery is tried at least once. That it is tried again although it may have arrived is said with the message: the
    attempt is written down before anything is sent, and its end is written only under a claim that still holds.
    """

    sessions: sessionmaker[Session]
    settings: Settings
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    rng: Random = field(default_factory=Random)
    failing: set[str] = field(default_factory=set)
    """Receivers whose last attempt went wrong."""

    def run(self, stop: Signal) -> None:
        """Deliver until `stop` is set; attempts that are under way then are brought to their end."""
        attempts, upkeep = Attempts(log), Upkeep(self.sessions, self.settings, self.clock)
        with ThreadPoolExecutor(AT_ONCE + 1, thread_name_prefix="delivery") as pool:
            under_way: set[Future[None]] = set()
            upkeeping = pool.submit(self._keep_up, upkeep)
            while not stop.is_set():
                with attempts.one():
                    under_way = self._begun(pool, under_way)
                if upkeeping.done():
                    upkeeping = pool.submit(self._keep_up, upkeep)
                stop.wait(attempts.pause(IDLE))
        with suppress(OperationalError):  # then the right lapses by itself
            upkeep.end()

    def run_until_idle(self) -> int:
        """Deliver until nothing is due; the number of attempts."""
        attempts = 0
        while (claim := self._claim()) is not None:
            self._deliver(claim)
            attempts += 1
        return attempts

    def _begun(self, pool: ThreadPoolExecutor, under_way: Collection[Future[None]]) -> set[Future[None]]:
        """The attempts under way, with as many new ones as there is room for."""
        going = {one for one in under_way if not one.done()}
        while len(going) < AT_ONCE and (claim := self._claim()) is not None:
            going.add(pool.submit(self._deliver, claim))
        return going

    def _keep_up(self, upkeep: Upkeep) -> None:
        try:
            upkeep.step()
        except OperationalError:  # told where the outbox is looked at
            return
        except Exception:  # a bug here stops no message
            log.exception("what a notifier does by the clock went wrong")

    def _claim(self) -> Claim | None:
        lease = timedelta(seconds=self.settings.notify.timeout) + SPARE
        with self.sessions.begin() as session:
            return claims.claim(session, self.clock(), lease, self._patience)

    def _deliver(self, claim: Claim) -> None:
        """One attempt, from the letter to the log; an end that cannot be written is found missing by who comes next."""
        begun = monotonic()
        answer = self._sent(claim)
        seconds = monotonic() - begun
        try:
            with self.sessions.begin() as session:
                held = claims.finish(session, claim, answer, seconds, self.clock(), self._patience, self.rng)
        except OperationalError as error:
            log.warning("the end of an attempt could not be written, its lease will lapse: %s", error.orig)
            return
        if not held:
            log.warning("delivery %d was taken over by another notifier", claim.delivery_id)
        self._tell(claim.receiver, answer)

    def _sent(self, claim: Claim) -> Answer:
        try:
            with reading(self.sessions)() as session:
                delivery = session.get_one(Delivery, claim.delivery_id)
                to = writing.addressee(delivery.receiver)
                letter = writing.letter(session, delivery, to.kind, self.settings.public_url, claim.is_repeat)
        except MissingVariableError as missing:
            return Answer("not_taken", str(missing))
        except Exception:  # a bug at one message stops no other, and is shown
            log.exception("delivery %d could not be written", claim.delivery_id)
            return Answer("not_taken", "it could not be written; the log has why")
        try:
            return SENDERS[to.kind](letter, to, self.settings, self.clock())
        except Exception:  # like the one before
            log.exception("delivery %d could not be sent", claim.delivery_id)
            return Answer("unknown", "an error of ours; the log has it")

    def _tell(self, receiver: str, answer: Answer) -> None:
        """One line when a receiver begins to fail, and one when it takes messages again."""
        if answer.outcome != "delivered" and receiver not in self.failing:
            self.failing.add(receiver)
            log.warning("messages to %s do not arrive: %s", receiver, answer.text)
        if answer.outcome == "delivered" and receiver in self.failing:
            self.failing.discard(receiver)
            log.info("messages to %s arrive again", receiver)

    @property
    def _patience(self) -> Patience:
        given = self.settings
        return Patience(
            given.notify.attempts,
            timedelta(seconds=given.notify.retry_delay),
            timedelta(seconds=given.notify.longest_delay),
        )
