"""The notifier: claims deliveries, sends them outside any transaction, and stores the results."""

import logging
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from random import Random
from threading import Event as Signal
from time import monotonic
from typing import TYPE_CHECKING

from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service import tracing
from service.db.problems import Attempts
from service.db.sessions import reading
from service.language.choice import speaking
from service.notify import claims, texts
from service.notify.channels import DeliveryResult
from service.notify.claims import Claim, RetryPolicy
from service.notify.rendering import (
    Destination,
    MissingVariableError,
    RenderedMessage,
    destination,
    rendered,
    with_report,
)
from service.notify.tables import Delivery
from service.settings import Settings

if TYPE_CHECKING:
    from service.notify.housekeeping import Housekeeping

log = logging.getLogger(__name__)

Send = Callable[[RenderedMessage, Destination, Settings, datetime], DeliveryResult]
IDLE = 0.5
"""s between two looks at the outbox."""
AT_ONCE = 8
"""Concurrent deliveries, so that a slow recipient does not delay others."""
SPARE = timedelta(seconds=60)
"""Time by which a lease outlasts the longest attempt: for the picture, and for a busy machine."""


def senders() -> Mapping[str, Send]:
    """By kind of recipient."""
    from service.notify.channels import alertmanager, chat, mail, webhook  # slow to import, and often nothing is due

    return {"email": mail.send, "webhook": webhook.send, "alertmanager": alertmanager.send, "apprise": chat.send}


@dataclass(slots=True)
class Notifier:
    """Delivers until it is stopped.

    Every delivery is attempted at least once. An attempt is stored before anything is sent, its result only under a
    valid claim; a message that may have arrived before says so.
    """

    sessions: sessionmaker[Session]
    settings: Settings
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    rng: Random = field(default_factory=Random)
    failing: set[str] = field(default_factory=set)
    """Recipients whose last attempt failed."""
    unsent: list[Claim] = field(default_factory=list)
    """Claims under which nothing was sent, because the database could not be read; undone as soon as it can be used."""

    def run(self, stop: Signal) -> None:
        """Deliver until `stop` is set; attempts under way are completed."""
        from service.notify.housekeeping import Housekeeping  # imports channels

        senders()  # imported now, so that no message waits for them
        attempts, housekeeping = Attempts(log), Housekeeping(self.sessions, self.settings, self.clock)
        with ThreadPoolExecutor(AT_ONCE + 1, thread_name_prefix="delivery") as pool:
            under_way: set[Future[None]] = set()
            step = pool.submit(self._step, housekeeping)
            while not stop.is_set():
                with attempts.one():
                    under_way = self._begun(pool, under_way)
                if step.done():
                    step = pool.submit(self._step, housekeeping)
                stop.wait(attempts.pause(IDLE))
        with suppress(OperationalError):  # the leases lapse by themselves
            self._withdraw_unsent()
            housekeeping.end()

    def run_until_idle(self) -> int:
        """Deliver until nothing is due; the number of attempts."""
        attempts = 0
        while (claim := self._claim()) is not None:
            self._deliver(claim)
            attempts += 1
        return attempts

    def _begun(self, pool: ThreadPoolExecutor, under_way: Collection[Future[None]]) -> set[Future[None]]:
        """The attempts under way, with new ones up to the limit."""
        going = {one for one in under_way if not one.done()}
        while len(going) < AT_ONCE and (claim := self._claim()) is not None:
            going.add(pool.submit(self._deliver, claim))
        return going

    def _step(self, housekeeping: "Housekeeping") -> None:
        try:
            housekeeping.step()
        except OperationalError:  # logged where the outbox is read
            return
        except Exception:  # a bug here does not stop deliveries
            log.exception("housekeeping of the notifier failed")

    def _claim(self) -> Claim | None:
        self._withdraw_unsent()
        lease = timedelta(seconds=self.settings.notify.timeout) + SPARE
        with self.sessions.begin() as session:
            return claims.claim(session, self.clock(), lease, self._retry_policy)

    def _withdraw_unsent(self) -> None:
        for claim in tuple(self.unsent):  # attempts under way may add others
            with self.sessions.begin() as session:
                claims.withdraw(session, claim)
            self.unsent.remove(claim)

    def _deliver(self, claim: Claim) -> None:
        """One attempt; if its result cannot be stored, the lease lapses and the delivery is attempted again."""
        with tracing.span("delivery", delivery=claim.delivery_id, recipient=claim.receiver):
            self._attempt(claim)

    def _attempt(self, claim: Claim) -> None:
        started = monotonic()
        try:
            with speaking(claim.language):
                result = self._sent(claim)
        except OperationalError:  # no fault of the message; logged where the outbox is read
            self.unsent.append(claim)
            return
        seconds = monotonic() - started
        try:
            with self.sessions.begin() as session:
                is_stored = claims.finish(session, claim, result, seconds, self.clock(), self._retry_policy, self.rng)
        except OperationalError as error:
            log.warning("the result of an attempt could not be stored, its lease will lapse: %s", error.orig)
            return
        if not is_stored:
            log.warning("delivery %d was claimed by another notifier", claim.delivery_id)
        self._log(claim.receiver, result)

    def _sent(self, claim: Claim) -> DeliveryResult:
        """The result of an attempt.

        Raises:
            OperationalError: the message could not be read from the database, so that nothing was sent.
        """
        try:
            with reading(self.sessions)() as session:
                delivery = session.get_one(Delivery, claim.delivery_id)
                to = destination(delivery.receiver)
                message = rendered(
                    session,
                    delivery.message,
                    delivery.created_at,
                    to.kind,
                    self.settings.public_url,
                    is_repeat=claim.is_repeat,
                )
                if delivery.receiver.with_report and to.kind == "email":
                    message = with_report(session, delivery.message, message, self.clock())
        except MissingVariableError as missing:
            return DeliveryResult("not_taken", str(missing))
        except OperationalError:
            raise
        except Exception:  # a bug with one message does not stop others, and is shown
            log.exception("delivery %d could not be rendered", claim.delivery_id)
            return DeliveryResult("not_taken", texts.NOT_RENDERED)
        try:
            with tracing.span("send", recipient_kind=to.kind):
                return senders()[to.kind](message, to, self.settings, self.clock())
        except Exception:  # as above
            log.exception("delivery %d could not be sent", claim.delivery_id)
            return DeliveryResult("unknown", texts.INTERNAL_ERROR)

    def _log(self, recipient: str, result: DeliveryResult) -> None:
        """One line when a recipient begins to fail, and one when it recovers."""
        if result.outcome != "delivered" and recipient not in self.failing:
            self.failing.add(recipient)
            log.warning("messages to %s do not arrive: %s", recipient, result.text)
        if result.outcome == "delivered" and recipient in self.failing:
            self.failing.discard(recipient)
            log.info("messages to %s arrive again", recipient)

    @property
    def _retry_policy(self) -> RetryPolicy:
        given = self.settings
        return RetryPolicy(
            given.notify.attempts,
            timedelta(seconds=given.notify.retry_delay),
            timedelta(seconds=given.notify.longest_delay),
        )
