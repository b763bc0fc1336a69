"""Does the work that waits: claims a job, has it computed elsewhere, writes the result under its claim."""

import logging
import os
import socket
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Event as Signal
from time import monotonic
from traceback import format_exception
from typing import Any

from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from core.errors import CoreError
from service.db import leases
from service.db.leases import WORKING
from service.db.problems import Attempts
from service.db.sessions import reading
from service.jobs import queue
from service.jobs.executors import Executors, end, out_of_reach_of_interrupts
from service.jobs.queue import Claim
from service.jobs.stages import Kind, Note, Running, silent
from service.settings import Settings

log = logging.getLogger(__name__)

IDLE = 0.5
"""s between two looks for work."""
HEED = 2.0
"""s between two looks for jobs that were cancelled."""


class JobTimeoutError(Exception):
    """A job that was stopped because it took too long."""

    def __init__(self, seconds: float) -> None:
        super().__init__(
            f"stopped after {seconds:g} s, the longest that a job may take (setting jobs.time_limit); fewer or shorter "
            "events take less time"
        )


@dataclass(slots=True)
class Worker:
    """Works until it is told to stop.

    A job is computed at least once and takes effect exactly once: the claim, the reading of the inputs and the
    writing of the result are three short transactions, and the last one writes only under a claim that still holds.
    """

    sessions: sessionmaker[Session]
    executors: Executors
    settings: Settings
    kinds: Mapping[str, Kind]
    """By the name that a job has."""
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    notes: Path | None = None
    """Folder in which computations tell what they are doing; None: who waits is told of whole stages."""
    running: dict[Future[Any], Running] = field(default_factory=dict)
    timer: Callable[[], float] = monotonic
    """s; the clock may be set meanwhile."""
    extended_at: float | None = None
    heeded_at: float = -float("inf")
    """s of the timer, of the latest look for cancelled jobs."""
    holder: str = field(default_factory=lambda: f"{socket.gethostname()}:{os.getpid()}")

    def run(self, stop: Signal) -> None:
        """Work until `stop` is set; jobs that are not finished then are put back."""
        attempts = Attempts(log)
        while not stop.is_set():
            busy = False
            with attempts.one():
                busy = self.step()
            if not busy:
                stop.wait(attempts.pause(IDLE))
        self.put_back()

    def run_until_idle(self) -> int:
        """Work until no job waits; the number of jobs that took effect or were given up."""
        finished = 0
        while self.fill() or self.running:
            finished += self.collect(IDLE)
            self.pass_on()
            self.heed()
            self.hold()
        return finished

    def step(self) -> bool:
        """Claim what there is room for, write what is done; False if there is nothing to do."""
        self.fill()
        self.collect(IDLE)
        self.pass_on()
        self.heed()
        self.hold()
        return bool(self.running)

    def fill(self) -> int:
        """Claim jobs and start them until every worker process has one; the number of jobs started."""
        started = 0
        while len(self.running) < self.settings.jobs.workers:
            claim = self._claim()
            if claim is None:
                break
            started += self._start(claim)
        return started

    def collect(self, timeout: float) -> int:
        """Write or go on with what was computed within `timeout` seconds; the number of jobs that are off our hands."""
        done = wait(self.running, timeout, FIRST_COMPLETED).done if self.running else ()
        finished = 0
        for future in done:
            job = self.running[future]
            finished += self._take(future, job)
            del self.running[future]  # only now: while the database is away the result is kept and written later
            if job.note:
                job.note.erase()
        return finished

    def pass_on(self) -> None:
        """Let those who wait know what the computations say they are doing."""
        for future, job in list(self.running.items()):
            if news := job.news:
                self._tell(job, news)
                self.running[future] = replace(job, told=news)

    def hold(self) -> None:
        """Extend the leases in time; a claim that was lost is left to who has it now."""
        elapsed, now = self.timer(), self.clock()
        if self.extended_at is not None and elapsed - self.extended_at < self.settings.jobs.lease / 3:
            return
        with self.sessions.begin() as session:
            leases.hold(session, WORKING, self.holder, now, self._lease)
        self.extended_at = elapsed
        for future, job in list(self.running.items()):
            with self.sessions.begin() as session:
                held = queue.extend(session, job.claim, now, self._lease)
            if not held:
                log.warning("job %d was taken over by another worker", job.claim.job_id)
                future.cancel()
                del self.running[future]

    def heed(self) -> None:
        """Stop what was cancelled, and what takes longer than a job may: that attempt counts as failed."""
        now = self.timer()
        if not self.running or now - self.heeded_at < HEED:
            return
        self.heeded_at = now
        limit = self.settings.jobs.time_limit
        overdue = {future for future, job in self.running.items() if now - job.begun > limit and not future.done()}
        with reading(self.sessions)() as session:
            running = queue.still_running(session, [job.claim for job in self.running.values()])
        cancelled = {future for future, job in self.running.items() if job.claim.job_id not in running}
        for future in overdue - cancelled:
            self._went_wrong(self.running[future].claim, JobTimeoutError(limit))
        self._stop(overdue | cancelled)

    def put_back(self) -> None:
        """Give up every claim, so that another worker need not wait for the lease to lapse."""
        try:
            for job in self.running.values():
                with self.sessions.begin() as session:
                    queue.release(session, job.claim)
            with self.sessions.begin() as session:
                leases.give_up(session, WORKING, self.holder)
        except OperationalError as error:
            log.warning("the database is out of reach, the claims will lapse by themselves: %s", error.orig)
        self.running.clear()

    def _stop(self, futures: Collection[Future[Any]]) -> None:
        """End these computations. Local processes are killed; the other jobs then begin their stage again.

        A Dask cluster cannot be made to stop: its worker computes to the end, and the result is dropped.
        """
        if not futures:
            return
        stopped = [self.running.pop(future) for future in futures]
        log.warning("stopped computing %s", ", ".join(f"job {job.claim.job_id}" for job in stopped))
        undone = [future for future in futures if not future.cancel() and not future.done()]
        for job in stopped:
            if job.note:
                job.note.erase()
        if undone and self.settings.jobs.executor == "local":
            others = {future: job for future, job in self.running.items() if not future.done()}
            end(self.executors, self.settings)
            for future, job in others.items():
                self._submit(job)
                del self.running[future]

    @property
    def _lease(self) -> timedelta:
        return timedelta(seconds=self.settings.jobs.lease)

    def _claim(self) -> Claim | None:
        with self.sessions.begin() as session:
            return queue.claim(session, self.clock(), self._lease)

    def _start(self, claim: Claim) -> bool:
        """Read what the job needs and start its first stage; False if it went wrong."""
        try:
            kind = self.kinds[claim.kind]
            with reading(self.sessions)() as session:
                inputs = kind.inputs(session, claim, self.settings)
            self._submit(Running(claim, inputs, kind.stages(inputs)))
        except OperationalError:
            raise
        except Exception as error:  # like the one below, this outlives a bug
            self._went_wrong(claim, error)
            return False
        return True

    def _take(self, future: Future[Any], job: Running) -> bool:
        """Go on with the next stage, or write the result; whether the job is off our hands."""
        try:
            after = replace(job, results=(*job.results, future.result()))
            if len(after.results) < len(after.stages):
                self._submit(after)
                return False
            self._write(after)
        except OperationalError:
            raise
        except Exception as error:
            self._went_wrong(job.claim, error)
        return True

    def _submit(self, job: Running) -> None:
        """Start the next stage, and say so first."""
        name = f"{job.claim.job_id}-{job.claim.token}-{len(job.results)}"
        note = Note(self.notes / name) if self.notes else None
        self._tell(job, job.stage.doing)
        with out_of_reach_of_interrupts():
            future = self.executors().submit(job.stage.function, *job.stage.arguments(job.results, note or silent))
        self.running[future] = replace(job, note=note, told=None)

    def _tell(self, job: Running, doing: str) -> None:
        with self.sessions.begin() as session:
            queue.tell(session, job.claim, len(job.results), len(job.stages), doing)

    def _write(self, job: Running) -> None:
        with self.sessions.begin() as session:
            if queue.finish(session, job.claim, self.clock()):
                self.kinds[job.claim.kind].store(session, job.claim, job.inputs, job.results, self.clock())

    def _went_wrong(self, claim: Claim, error: Exception) -> None:
        """A refusal is shown at once; a bug or a killed process is tried again, and shown when given up."""
        if isinstance(error, CoreError):
            with self.sessions.begin() as session:
                queue.refuse(session, claim, str(error), self.clock())
            return
        log.error("attempt %d at job %d went wrong", claim.failures + 1, claim.job_id, exc_info=error)
        text = "".join(format_exception(error))
        with self.sessions.begin() as session:
            queue.fail(session, claim, text, self.clock(), self.settings.jobs.attempts)
