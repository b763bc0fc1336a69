"""When sources are looked at: one process at a time, every building at its own pace."""

import logging
import os
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from threading import Event as Signal

from apscheduler.schedulers.background import BackgroundScheduler
from sqlalchemy import select
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service import leases
from service.database import Building
from service.looking import Look
from service.settings import Settings

log = logging.getLogger(__name__)

POLLING = "polling"
LEASE = timedelta(seconds=60)
ROUND = 5.0
"""s between two looks at the lease, at the list of buildings and at the events that wait."""
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
    away: bool = False
    """Whether the database is out of reach."""

    def run(self, stop: Signal) -> None:
        """Poll until `stop` is set; looks that are under way then are left at their next step."""
        look = Look(self.sessions, self.settings, self.clock, stop.wait, stop.is_set)
        executors = {"default": {"type": "threadpool", "max_workers": AT_ONCE}}
        scheduler = BackgroundScheduler(
            executors=executors, job_defaults={"coalesce": True, "max_instances": 1}, timezone=UTC
        )
        scheduler.start()
        try:
            while not stop.is_set():
                with self._forgiving():
                    self._round(scheduler, look)
                stop.wait(min(ROUND, self.settings.poll_interval))
        finally:
            scheduler.shutdown(wait=True)
            with self._forgiving(), self.sessions.begin() as session:
                leases.give_up(session, POLLING, self.holder)

    def _round(self, scheduler: BackgroundScheduler, look: Look) -> None:
        """Keep the right to poll, and one clock for every building while it is ours."""
        with self.sessions.begin() as session:
            holds = leases.hold(session, POLLING, self.holder, self.clock(), LEASE)
            codes = set(session.scalars(select(Building.code))) if holds else set()
        if holds != self.holds:
            log.info("polling here" if holds else "another process polls")
            self.holds = holds
        running = {job.id for job in scheduler.get_jobs()}
        for code in running - codes:
            scheduler.remove_job(code)
        for code in sorted(codes - running):
            scheduler.add_job(
                self._look,
                "interval",
                args=(look, code),
                id=code,
                seconds=self.settings.poll_interval,
                next_run_time=self.clock(),
                misfire_grace_time=None,
            )
        if holds:
            look.queue_ready()

    def _look(self, look: Look, code: str) -> None:
        with self._forgiving():
            try:
                look.at(code)
            except OperationalError:
                raise
            except Exception:  # a bug at one building stops no other, and is shown each time
                log.exception("looking at the source of %s went wrong", code)

    @contextmanager
    def _forgiving(self) -> Iterator[None]:
        """A database that is away for a while ends nothing: the next round tries again."""
        try:
            yield
        except OperationalError as error:
            if not self.away:
                log.warning("the database is out of reach, trying again: %s", error.orig)
            self.away = True
        else:
            if self.away:
                log.warning("the database is back")
            self.away = False
