"""What does one of the notifiers do by the clock? It repeats what stands, and says outside that the service works."""

import logging
import os
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from math import inf
from time import monotonic

import httpx
from sqlalchemy.orm import Session, sessionmaker

from service.db import leases
from service.db.sessions import reading
from service.health import readiness
from service.notify import alertmanager_resend, writing
from service.notify.channels import alertmanager
from service.notify.letter import Addressee, Letter
from service.notify.tables import Delivery
from service.settings import Settings

log = logging.getLogger(__name__)

NOTIFYING = "notifying"
"""The right of the one notifier that does it."""
LEASE = timedelta(seconds=60)
ROUND = 5.0
"""s between two looks at what is due, at most."""


@dataclass(slots=True)
class Upkeep:
    """Done again and again, by whichever notifier holds the right."""

    sessions: sessionmaker[Session]
    settings: Settings
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    holder: str = field(default_factory=lambda: f"{socket.gethostname()}:{os.getpid()}")
    timer: Callable[[], float] = monotonic
    """s; the clock may be set meanwhile."""
    next_step: float = -inf
    next_beat: float = -inf
    trouble: dict[str, str] = field(default_factory=dict)
    """What goes wrong now, by what it is about: told in the log once, and once when it is over."""

    def step(self) -> None:
        """Do what is due, every few seconds at most."""
        if self.timer() < self.next_step:
            return
        given = self.settings
        self.next_step = self.timer() + min(ROUND, given.notify.alertmanager_interval, given.heartbeat.interval)
        with self.sessions.begin() as session:
            holds = leases.hold(session, NOTIFYING, self.holder, self.clock(), LEASE)
        if holds:
            self._repeat_what_stands()
            self._beat()

    def end(self) -> None:
        """Let another notifier have the right at once."""
        with self.sessions.begin() as session:
            leases.give_up(session, NOTIFYING, self.holder)

    def _repeat_what_stands(self) -> None:
        with reading(self.sessions)() as session:
            due = alertmanager_resend.due(session, self.clock(), self._interval)
            written = [self._written(session, delivery) for delivery in due]
        for one in written:
            if one is not None:
                self._repeat(*one)

    def _written(self, session: Session, delivery: Delivery) -> tuple[int, Letter, Addressee] | None:
        try:
            to = writing.addressee(delivery.receiver)
        except writing.MissingVariableError as missing:
            self._note(delivery.receiver.name, str(missing))
            return None
        letter = writing.letter(session, delivery, to.kind, self.settings.public_url, is_repeat=False)
        return delivery.id, letter, to

    def _repeat(self, delivery_id: int, letter: Letter, to: Addressee) -> None:
        answer = alertmanager.send(letter, to, self.settings, self.clock())
        self._note(f"{letter.building_code}/{to.name}", None if answer.outcome == "delivered" else answer.text)
        if answer.outcome == "delivered":
            with self.sessions.begin() as session:
                alertmanager_resend.kept(session, delivery_id, self.clock())

    def _beat(self) -> None:
        """Say outside that the service works, if it does: who waits for that in vain has somebody look after it."""
        if self.settings.heartbeat.url is None or self.timer() < self.next_beat:
            return
        self.next_beat = self.timer() + self.settings.heartbeat.interval
        with reading(self.sessions)() as session:
            lacks = "; ".join(readiness.lacks(session, self.settings, self.clock()))
        self._note("heartbeat", lacks or self._asked(self.settings.heartbeat.url.get_secret_value()))

    def _asked(self, url: str) -> str | None:
        """What went wrong, without the address: it is a secret."""
        try:
            answer = httpx.get(url, timeout=self.settings.notify.timeout)
        except (httpx.HTTPError, httpx.InvalidURL) as error:
            return type(error).__name__
        return None if answer.is_success else f"answered {answer.status_code}"

    def _note(self, about: str, trouble: str | None) -> None:
        if trouble is None and about in self.trouble:
            del self.trouble[about]
            log.info("%s: all is well again", about)
        if trouble is not None and self.trouble.get(about) != trouble:
            self.trouble[about] = trouble
            log.warning("%s: %s", about, trouble)

    @property
    def _interval(self) -> timedelta:
        return timedelta(seconds=self.settings.notify.alertmanager_interval)
