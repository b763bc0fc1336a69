"""When sources are looked at: one process at a time, every building at its own pace."""

import logging
import os
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from threading import Event as Signal

from apscheduler.schedulers.background import BackgroundScheduler
from sqlalchemy import select
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service.alerting import rounds
from service.database import Building
from service.database_away import Attempts
from service.intake.looking import Look
from service.queue import leases
from service.queue.leases import POLLING
from service.settings import Settings

log = logging.getLogger(__name__)

LEASE = timedelta(seconds=60)
ROUND = 5.0
"""s between two looks at the lease, at the list of buildings and at the events that wait."""
CHECKS = "checks/"
"""Of the scheduler's job beside those of the buildings; no code has a slash."""
AT_ONCE = 10
"""Buildings that are looked at together."""


@dataclass(slots=True)
class Poller:
    """Polls until it is told to stop."""

    sessions: sessionmaker[Session]
    settings: Settings
    holder: str = field(default_factory=lambda: f"{socket.gethostname()}:{os.getpid()}")
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    holds: bool = False
    attempts: Attempts = field(default_factory=lambda: Attempts(log))
    """Of the rounds, the looks and the checks."""

    def run(self, stop: Signal) -> None:
        """Poll until `stop` is set; looks that are under way then are left at their next step."""
        look = Look(self.sessions, self.settings, self.clock, stop.wait, stop.is_set)
        executors = {
            name: {"type": "threadpool", "max_workers": number}
            for name, number in (("default", AT_ONCE), ("checks", 1))
        }
        scheduler = BackgroundScheduler(
            executors=executors, job_defaults={"coalesce": True, "max_instances": 1}, timezone=UTC
        )
        scheduler.start()
        try:
            while not stop.is_set():
                with self.attempts.one():
                    self._round(scheduler, look)
                stop.wait(min(ROUND, self.settings.poll_interval))
        finally:
            scheduler.shutdown(wait=True)
            with self.attempts.one(), self.sessions.begin() as session:
                leases.give_up(session, POLLING, self.holder)

    def _round(self, scheduler: BackgroundScheduler, look: Look) -> None:
        """Keep the right to poll, and one clock for every building while it is ours."""
        with self.sessions.begin() as session:
            holds = leases.hold(session, POLLING, self.holder, self.clock(), LEASE)
            codes = set(session.scalars(select(Building.code))) if holds else set()
        if holds != self.holds:
            log.info("polling here" if holds else "another process polls")
            self.holds = holds
        running, wanted = {job.id for job in scheduler.get_jobs()}, codes | ({CHECKS} if holds else set())
        for name in running - wanted:
            scheduler.remove_job(name)
        for name in sorted(wanted - running):
            self._start(scheduler, look, name)
        if holds:
            look.queue_ready()

    def _start(self, scheduler: BackgroundScheduler, look: Look, name: str) -> None:
        """A clock for a building, or for the checks; these have a thread of their own, for looks may hang."""
        checks = name == CHECKS
        scheduler.add_job(
            self._check if checks else self._look,
            "interval",
            args=() if checks else (look, name),
            id=name,
            executor="checks" if checks else "default",
            seconds=self.settings.check_interval if checks else self.settings.poll_interval,
            next_run_time=self.clock(),
            misfire_grace_time=None,
        )

    def _check(self) -> None:
        with self.attempts.one():
            try:
                rounds.go_round(self.sessions, self.settings, self.clock())
            except OperationalError:
                raise
            except Exception:  # like the one below: the next round tries again
                log.exception("looking whether data stopped went wrong")

    def _look(self, look: Look, code: str) -> None:
        with self.attempts.one():
            try:
                look.at(code)
            except OperationalError:
                raise
            except Exception:  # a bug at one building stops no other, and is shown each time
                log.exception("looking at the source of %s went wrong", code)
