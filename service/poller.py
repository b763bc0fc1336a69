"""The poller: polls buildings' sources, each at its own interval; several pollers share the buildings.

A building belongs to the living poller whose name and the building's code have the largest common hash (rendezvous
hashing; Thaler and Ravishankar, 1998), so that a poller that joins or dies moves no other building. A poller that joins
polls nothing until every other one has renewed its lease, and with that has seen it. One poller, which has the lease
for it, does the periodic checks and queues events.
"""

import hashlib
import logging
import os
import socket
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from threading import Event as Signal

from apscheduler.executors.pool import ThreadPoolExecutor
from apscheduler.schedulers.background import BackgroundScheduler
from apscheduler.triggers.base import BaseTrigger
from sqlalchemy import select
from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from service.alerts import early_messages, periodic_checks
from service.alerts.checked_buildings import Checked
from service.buildings.tables import Building
from service.db import process_leases
from service.db.problems import Attempts
from service.db.process_leases import POLLING, POLLING_LEASE, SHARING
from service.errors import StoreAwayError
from service.records.source_poller import SourcePoller
from service.records.source_schedule import SourceSchedule
from service.records.streams.following import Streams
from service.records.tables import SourceState
from service.settings import Settings

log = logging.getLogger(__name__)

ROUND = 5.0
"""s between two renewals of the lease, with a look at the buildings and the waiting events."""
A_MOMENT = timedelta(seconds=1)
"""Tolerance within which a time ahead of the clock is no sign of a changed clock."""
CHECKS = "checks/"
"""The scheduler's job for the checks; no building code contains a slash."""


@dataclass(frozen=True, slots=True)
class Every(BaseTrigger):  # type: ignore[misc]  # APScheduler has no types
    """A trigger that fires at once, and then at an interval after each firing.

    The interval counts from now, not from the planned time: otherwise a clock set ahead would cause a burst of firings.
    """

    interval: timedelta

    def get_next_fire_time(self, previous: datetime | None, now: datetime) -> datetime:
        """The next time, as APScheduler requests it."""
        return now if previous is None else now + self.interval


def owner(code: str, pollers: Collection[str]) -> str:
    """The poller that a building belongs to."""
    return max(pollers, key=lambda one: hashlib.sha256(f"{one}/{code}".encode()).digest())


@dataclass(slots=True)
class Poller:
    """The poller.

    APScheduler decides when a source is due; separate threads poll it.
    """

    sessions: sessionmaker[Session]
    settings: Settings
    holder: str = field(default_factory=lambda: f"{socket.gethostname()}:{os.getpid()}")
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    holds: bool = False
    """True while it does the periodic checks."""
    share: frozenset[str] = frozenset()
    """Codes of the buildings that it polls."""
    met: dict[str, datetime] | None = None
    """End of the lease of every other poller in the first round; empty once they all have renewed it, or died."""
    attempts: Attempts = field(default_factory=lambda: Attempts(log))
    """Database attempts of rounds, polls and checks."""
    checked: dict[int, Checked] = field(default_factory=dict)
    """Each building's state at its last check."""

    def run(self, stop: Signal) -> None:
        """Poll until `stop` is set; polls in progress end at their next step, or are abandoned while their server
        keeps them waiting."""
        streams = Streams(self.sessions, self.settings, self.holder, self.clock, early_messages.write)
        schedule = SourceSchedule(lambda code: self._poll(sources, code), self.settings.polling.interval)
        sources = SourcePoller(
            self.sessions, self.settings, self.clock, stop.wait, stop.is_set, streams.follow, schedule.next
        )
        scheduler = BackgroundScheduler(
            executors={"default": ThreadPoolExecutor(1), "checks": ThreadPoolExecutor(1)},
            job_defaults={"coalesce": True, "max_instances": 1, "misfire_grace_time": None},
            timezone=UTC,
        )
        scheduler.start()
        try:
            while not stop.is_set():
                with self.attempts.one():
                    self._round(scheduler, sources, schedule, stop)
                streams.keep_only(self.share)
                stop.wait(min(ROUND, self.settings.polling.interval))
        finally:
            scheduler.shutdown(wait=True)
            streams.end()
            if left := schedule.end():
                log.warning("stopped before the sources of %s had answered; no data is lost", ", ".join(left))
            with self.attempts.one():
                sources.together.store()
            with self.attempts.one(), self.sessions.begin() as session:
                process_leases.give_up(session, POLLING, self.holder)
                process_leases.give_up(session, SHARING + self.holder, self.holder)

    def _round(
        self, scheduler: BackgroundScheduler, sources: SourcePoller, schedule: SourceSchedule, stop: Signal
    ) -> None:
        """Renew the leases, and schedule one job for every building of this poller's share."""
        now = self.clock()
        with self.sessions.begin() as session:
            holds = process_leases.hold(session, POLLING, self.holder, now, POLLING_LEASE)
            process_leases.hold(session, SHARING + self.holder, self.holder, now, POLLING_LEASE)
            pollers = process_leases.sharing(session, now)
            codes = session.scalars(select(Building.code)).all()
        own = [] if self._is_joining(pollers) else [one for one in codes if owner(one, pollers) == self.holder]
        share = frozenset(own)
        if holds and not self.holds:
            log.info("polling here")
        if share != self.share and len(pollers) > 1:
            log.info("%d of %d buildings are polled here, by one of %d pollers", len(share), len(codes), len(pollers))
        self.holds, self.share = holds, share
        running, due = {job.id for job in scheduler.get_jobs()}, share | ({CHECKS} if holds else set())
        for name in running - due:
            scheduler.remove_job(name)
        if new := due - running:
            schedule.expect_failure(self._failing())
        for name in sorted(new):
            self._start(scheduler, schedule, name, stop.is_set)
        self._run_overdue(scheduler)
        schedule.go_on()
        sources.together.store()
        for code, seconds in schedule.lasting():
            sources.note_attempt(code, now - timedelta(seconds=seconds))
        if holds:
            sources.queue_ready()

    def _is_joining(self, pollers: Mapping[str, datetime]) -> bool:
        """True until every poller that was there before has seen this one."""
        met = {name: end for name, end in pollers.items() if name != self.holder} if self.met is None else self.met
        self.met = {name: end for name, end in met.items() if pollers.get(name) == end}
        return bool(self.met)

    def _start(
        self, scheduler: BackgroundScheduler, schedule: SourceSchedule, name: str, stopped: Callable[[], bool]
    ) -> None:
        """Schedule a building, or the checks, which take long and have their own thread."""
        checks = name == CHECKS
        scheduler.add_job(
            self._check if checks else schedule.due,
            Every(timedelta(seconds=self.settings.data_health.interval if checks else self.settings.polling.interval)),
            args=(stopped,) if checks else (name,),
            id=name,
            executor="checks" if checks else "default",
        )

    def _run_overdue(self, scheduler: BackgroundScheduler) -> None:
        """Run jobs at once that are due later than an interval from now: the clock was set back."""
        now = self.clock()
        late = [job for job in scheduler.get_jobs() if job.next_run_time > now + job.trigger.interval + A_MOMENT]
        if late:
            ahead = max(job.next_run_time - job.trigger.interval for job in late) - now
            log.warning("the clock was set back by about %.0f s; all sources are polled now", ahead.total_seconds())
        for job in late:
            job.modify(next_run_time=now)

    def _failing(self) -> list[str]:
        """Codes of the buildings whose last poll failed, in this process or an earlier one."""
        buildings = select(Building.code).join(SourceState, SourceState.building_id == Building.id)
        with self.sessions() as session:
            return list(session.scalars(buildings.where(SourceState.failing_since.is_not(None))))

    def _check(self, stopped: Callable[[], bool]) -> None:
        with self.attempts.one():
            try:
                periodic_checks.check_buildings(self.sessions, self.settings, self.clock(), stopped, self.checked)
            except OperationalError:
                raise
            except Exception:  # as below: the next round repeats it
                log.exception("the check of data health failed")

    def _poll(self, sources: SourcePoller, code: str) -> bool:
        """True if the source answered; a fault that is not the source's does not count as a failure."""
        with self.attempts.one():
            try:
                return sources.poll(code)
            except OperationalError:
                raise
            except StoreAwayError:  # logged where it began
                return False
            except Exception:  # a bug at one building must not stop the others; it is logged each time
                log.exception("polling the source of %s failed", code)
        return True
