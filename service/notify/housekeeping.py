"""Housekeeping by one of the notifiers: repeats open alerts to Alertmanagers, and sends the heartbeat."""

import logging
import os
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from math import inf
from time import monotonic

import httpx
from sqlalchemy import exists, or_, select, update
from sqlalchemy.orm import Session, aliased, sessionmaker

from service.db import process_leases
from service.db.process_leases import NOTIFYING, is_wrong
from service.db.sessions import reading
from service.health import readiness
from service.notify.channels import alertmanager
from service.notify.rendering import Destination, MissingVariableError, RenderedMessage, destination, rendered
from service.notify.tables import Delivery, Message, Receiver
from service.settings import Settings
from service.tls import tls_context

log = logging.getLogger(__name__)

LEASE = timedelta(seconds=60)
"""Time after which the lease of a silent notifier expires. Not tuned."""
LONGEST_PAUSE = 5.0
"""s between two steps, at most."""


@dataclass(slots=True)
class Housekeeping:
    """Repeated steps, done by whichever notifier holds the lease."""

    sessions: sessionmaker[Session]
    settings: Settings
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    holder: str = field(default_factory=lambda: f"{socket.gethostname()}:{os.getpid()}")
    timer: Callable[[], float] = monotonic
    """s; independent of changes of the clock."""
    next_step: float = -inf
    next_beat: float = -inf
    problems: dict[str, str] = field(default_factory=dict)
    """Current problems by subject: logged once when they begin, and once when they are over."""

    def step(self) -> None:
        """Do what is due; in between, nothing."""
        if self.timer() < self.next_step:
            return
        given = self.settings
        self.next_step = self.timer() + min(LONGEST_PAUSE, given.notify.alertmanager_interval, given.heartbeat.interval)
        with self.sessions.begin() as session:
            holds = process_leases.hold(session, NOTIFYING, self.holder, self.clock(), LEASE)
        if holds:
            self._resend()
            self._beat()

    def end(self) -> None:
        """Give up the lease, so that another notifier takes over at once."""
        with self.sessions.begin() as session:
            process_leases.give_up(session, NOTIFYING, self.holder)

    def _resend(self) -> None:
        interval = timedelta(seconds=self.settings.notify.alertmanager_interval)
        with reading(self.sessions)() as session:
            messages = [self._rendered(session, one) for one in due_to_resend(session, self.clock(), interval)]
        for one in messages:
            if one is not None:
                self._send(*one)

    def _rendered(self, session: Session, delivery: Delivery) -> tuple[int, RenderedMessage, Destination] | None:
        try:
            to = destination(delivery.receiver)
        except MissingVariableError as missing:
            self._note(delivery.receiver.name, str(missing))
            return None
        url = self.settings.public_url
        message = rendered(session, delivery.message, delivery.created_at, to.kind, url, is_repeat=False)
        return delivery.id, message, to

    def _send(self, delivery_id: int, message: RenderedMessage, to: Destination) -> None:
        result = alertmanager.send(message, to, self.settings, self.clock())
        self._note(f"{message.building_code}/{to.name}", None if result.outcome == "delivered" else result.text)
        if result.outcome == "delivered":
            with self.sessions.begin() as session:
                resent(session, delivery_id, self.clock())

    def _beat(self) -> None:
        """Send the heartbeat if the service works: its absence alerts whoever monitors the service."""
        if self.settings.heartbeat.url is None or self.timer() < self.next_beat:
            return
        self.next_beat = self.timer() + self.settings.heartbeat.interval
        with reading(self.sessions)() as session:
            problem = "; ".join(readiness.lacks(session, self.settings, self.clock()))
        self._note("heartbeat", problem or self._request(self.settings.heartbeat.url.get_secret_value()))

    def _request(self, url: str) -> str | None:
        """The error, without the address, which is a secret; None if there is none."""
        try:
            answer = httpx.get(url, timeout=self.settings.notify.timeout, verify=tls_context())
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            return type(error).__name__
        return None if answer.is_success else f"answered {answer.status_code}"

    def _note(self, subject: str, problem: str | None) -> None:
        if problem is None and subject in self.problems:
            del self.problems[subject]
            log.info("%s: all is well again", subject)
        if problem is not None and self.problems.get(subject) != problem:
            self.problems[subject] = problem
            log.warning("%s: %s", subject, problem)


def due_to_resend(session: Session, now: datetime, interval: timedelta) -> Sequence[Delivery]:
    """Deliveries to Alertmanagers of open alerts without later messages, last sent an interval ago."""
    later = aliased(Message)
    has_later = exists().where(
        later.building_id == Message.building_id, later.key == Message.key, later.number > Message.number
    )
    last = Delivery.kept_at
    query = (
        select(Delivery)
        .join(Delivery.message)
        .join(Delivery.receiver)
        .where(Receiver.kind == "alertmanager", Receiver.removed_at.is_(None))
        .where(Message.kind.in_(alertmanager.LASTING), Message.is_over.is_(False))
        .where(
            Delivery.state == "delivered",
            or_(last <= now - interval, is_wrong(last, now - interval, interval)),
            ~has_later,
        )
    )
    return session.scalars(query.order_by(Delivery.id)).all()


def resent(session: Session, delivery_id: int, now: datetime) -> None:
    """Store that a delivery was sent again."""
    session.execute(update(Delivery).where(Delivery.id == delivery_id).values(kept_at=now))
