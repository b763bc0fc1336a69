"""When sources are looked at: one process at a time, every building at its own pace."""

import logging
import os
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from threading import Event as Signal

from apscheduler.executors.pool import ThreadPoolExecutor
from apscheduler.schedulers.background import BackgroundScheduler
from apscheduler.triggers.base import BaseTrigger
from sqlalchemy import select
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import periodic_checks
from service.buildings.tables import Building
from service.db import leases
from service.db.leases import POLLING, POLLING_LEASE
from service.db.problems import Attempts
from service.records.lanes import Lanes
from service.records.polling import SourcePoller
from service.records.tables import SourceState
from service.settings import Settings

log = logging.getLogger(__name__)

ROUND = 5.0
"""s between two looks at the lease, at the list of buildings and at the events that wait."""
A_MOMENT = timedelta(seconds=1)
"""By which a time may lie ahead without any cause."""
CHECKS = "checks/"
"""The scheduler's job beside those of the buildings; no code has a slash."""


@dataclass(frozen=True, slots=True)
class Every(BaseTrigger):  # type: ignore[misc]  # APScheduler has no types
    """Due at once, and then so long after it was due last.

    Counted from now, not from when it was to be: else a clock that is set ahead makes up for all the times between.
    """

    interval: timedelta

    def get_next_fire_time(self, previous: datetime | None, now: datetime) -> datetime:
        """As APScheduler asks for it."""
        return now if previous is None else now + self.interval


@dataclass(slots=True)
class Poller:
    """Polls until it is stopped.

    APScheduler says when a source is due, threads of our own look at it.
    """

    sessions: sessionmaker[Session]
    settings: Settings
    holder: str = field(default_factory=lambda: f"{socket.gethostname()}:{os.getpid()}")
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    holds: bool = False
    attempts: Attempts = field(default_factory=lambda: Attempts(log))
    """Of the rounds, the looks and the checks."""
    checked: dict[int, periodic_checks.Checked] = field(default_factory=dict)
    """State of each building at its last check."""

    def run(self, stop: Signal) -> None:
        """Poll until `stop` is set; looks under way are left at their next step, or where their server keeps them."""
        sources = SourcePoller(self.sessions, self.settings, self.clock, stop.wait, stop.is_set)
        lanes = Lanes(lambda code: self._poll(sources, code), self.settings.polling.interval)
        scheduler = BackgroundScheduler(
            executors={"default": ThreadPoolExecutor(1), "checks": ThreadPoolExecutor(1)},
            job_defaults={"coalesce": True, "max_instances": 1, "misfire_grace_time": None},
            timezone=UTC,
        )
        scheduler.start()
        try:
            while not stop.is_set():
                with self.attempts.one():
                    self._round(scheduler, sources, lanes, stop)
                stop.wait(min(ROUND, self.settings.polling.interval))
        finally:
            scheduler.shutdown(wait=True)
            if left := lanes.end():
                log.warning("stopped while the sources of %s had not answered; nothing is lost", ", ".join(left))
            with self.attempts.one(), self.sessions.begin() as session:
                leases.give_up(session, POLLING, self.holder)

    def _round(self, scheduler: BackgroundScheduler, sources: SourcePoller, lanes: Lanes, stop: Signal) -> None:
        """Keep the right to poll, and one clock for every building while it is ours."""
        with self.sessions.begin() as session:
            holds = leases.hold(session, POLLING, self.holder, self.clock(), POLLING_LEASE)
            codes = set(session.scalars(select(Building.code))) if holds else set()
        if holds != self.holds:
            log.info("polling here" if holds else "another process polls")
            self.holds = holds
        running, wanted = {job.id for job in scheduler.get_jobs()}, codes | ({CHECKS} if holds else set())
        for name in running - wanted:
            scheduler.remove_job(name)
        if new := wanted - running:
            lanes.expect_failure(self._failing())
        for name in sorted(new):
            self._start(scheduler, lanes, name, stop.is_set)
        self._mind_the_clock(scheduler)
        lanes.go_on()
        if holds:
            sources.queue_ready()

    def _start(self, scheduler: BackgroundScheduler, lanes: Lanes, name: str, stopped: Callable[[], bool]) -> None:
        """A clock for a building, or for the checks, which take long and have a thread of their own."""
        checks = name == CHECKS
        scheduler.add_job(
            self._check if checks else lanes.due,
            Every(timedelta(seconds=self.settings.data_health.interval if checks else self.settings.polling.interval)),
            args=(stopped,) if checks else (name,),
            id=name,
            executor="checks" if checks else "default",
        )

    def _mind_the_clock(self, scheduler: BackgroundScheduler) -> None:
        """What is due later than its interval from now was set so before the clock was set back: it is due now."""
        now = self.clock()
        late = [job for job in scheduler.get_jobs() if job.next_run_time > now + job.trigger.interval + A_MOMENT]
        if late:
            ahead = max(job.next_run_time - job.trigger.interval for job in late) - now
            log.warning("the clock was set back by about %.0f s; everything is looked at now", ahead.total_seconds())
        for job in late:
            job.modify(next_run_time=now)

    def _failing(self) -> list[str]:
        """Codes of the buildings whose sources failed at the last look, of this process or one before it."""
        question = select(Building.code).join(SourceState, SourceState.building_id == Building.id)
        with self.sessions() as session:
            return list(session.scalars(question.where(SourceState.failing_since.is_not(None))))

    def _check(self, stopped: Callable[[], bool]) -> None:
        with self.attempts.one():
            try:
                periodic_checks.check_buildings(self.sessions, self.settings, self.clock(), stopped, self.checked)
            except OperationalError:
                raise
            except Exception:  # like the one below: the next round tries again
                log.exception("looking whether data stopped went wrong")

    def _poll(self, sources: SourcePoller, code: str) -> bool:
        """Whether the source answered; what is no fault of the source does not count as a failure."""
        with self.attempts.one():
            try:
                return sources.poll(code)
            except OperationalError:
                raise
            except Exception:  # a bug at one building stops no other, and is shown each time
                log.exception("looking at the source of %s went wrong", code)
        return True
