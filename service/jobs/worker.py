"""The worker: claims jobs, has them computed in other processes, and stores their results under the claim."""

import logging
import os
import socket
from collections.abc import Callable, Collection, Mapping
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from threading import Event as Signal
from time import monotonic, sleep
from traceback import format_exception
from typing import Any

from sqlalchemy.exc import OperationalError
from sqlalchemy.orm import Session, sessionmaker

from core.errors import CoreError
from service import logs
from service.db import process_leases
from service.db.problems import Attempts, problem
from service.db.process_leases import WORKING
from service.db.sessions import reading
from service.errors import StoreAwayError
from service.jobs import queue
from service.jobs.executors import (
    Executors,
    JobExecutor,
    LostComputationError,
    in_processes,
    is_warmed,
    without_stop_signals,
)
from service.jobs.kept import Kept
from service.jobs.queue import Claim
from service.jobs.stages import Kind, Note, Report, Running, silent
from service.settings import Settings
from service.tracing import Work

log = logging.getLogger(__name__)

IDLE = 0.5
"""s between two queries for waiting jobs."""
HEED = 2.0
"""s between two queries for cancelled jobs."""
WARMED_AFTER = 2.0
"""s without a job after which idle processes are warmed."""


class JobTimeoutError(Exception):
    """A job that was stopped because it took too long."""

    def __init__(self, seconds: float) -> None:
        super().__init__(
            f"stopped after {seconds:g} s, the longest that a job may take (setting jobs.time_limit); fewer or shorter "
            "events take less time"
        )


@dataclass(slots=True)
class Worker:
    """A worker: computes jobs until it is stopped.

    A job is computed at least once and takes effect exactly once: the claim, the reading of the inputs and the
    writing of the result are three short transactions, and the last one writes only under a claim that still holds.
    """

    sessions: sessionmaker[Session]
    executors: Executors
    settings: Settings
    kinds: Mapping[str, Kind]
    """Kinds of jobs by name."""
    clock: Callable[[], datetime] = lambda: datetime.now(UTC)
    notes: Path | None = None
    """Folder in which computations report their progress; None: only whole stages are reported."""
    running: dict[Future[Any], Running] = field(default_factory=dict)
    timer: Callable[[], float] = monotonic
    """s; independent of changes of the clock."""
    kept: Kept = field(default_factory=Kept)
    """Results of stages."""
    warming: Callable[[], None] | None = None
    """Prepares a process of this machine for its first job, while there is none."""
    is_warm: bool = False
    """True once the processes were warmed, until they are ended."""
    first_warmed: Future[None] | None = None
    """Result of the one process that is warmed before the others."""
    trouble: str | None = None
    """Obstacle to the executor's computing at the last look."""
    extended_at: float | None = None
    cancelled_checked_at: float = -float("inf")
    """s of the timer at the latest query for cancelled jobs."""
    holder: str = field(default_factory=lambda: f"{socket.gethostname()}:{os.getpid()}")

    def run(self, stop: Signal) -> None:
        """Work until `stop` is set; unfinished jobs return to the queue."""
        attempts, idle_since = Attempts(log), self.timer()
        while not stop.is_set():
            busy = False
            with attempts.one():
                busy = self.step()
            if busy:
                idle_since = self.timer()
                continue
            if not self.is_warm and self.timer() - idle_since >= WARMED_AFTER:
                self.warm()
            stop.wait(attempts.pause(IDLE))
        self.put_back()

    def warm(self) -> None:
        """Warm one process of this machine, and once it is warm the others.

        The first may compile for half a minute what the others then find compiled, and jobs go to them meanwhile.
        """
        if self.warming is None or not is_warmed(self.settings):
            self.is_warm = True
        elif self.first_warmed is None:
            (self.first_warmed,) = in_processes(self.executors, self.warming, 1)
        elif self.first_warmed.done():
            in_processes(self.executors, self.warming, self.settings.jobs.processes - 1)
            self.is_warm, self.first_warmed = True, None

    def run_until_idle(self) -> int:
        """Work until no job waits; the number of jobs that were finished or failed."""
        finished = 0
        while self.fill() or self.running or self.trouble is not None:
            finished += self.collect(IDLE)
            if self.trouble is not None and not self.running:
                sleep(IDLE)
            self.store_progress()
            self.stop_cancelled()
            self.hold()
        return finished

    def step(self) -> bool:
        """Claim jobs for free processes and store results; False if there is nothing to do."""
        self.fill()
        self.collect(IDLE)
        self.store_progress()
        self.stop_cancelled()
        self.hold()
        return bool(self.running)

    def fill(self) -> int:
        """Claim and start jobs until every process has one; the number of jobs started.

        None is claimed while the executor cannot compute.
        """
        if self._notice_trouble():
            return 0
        started = 0
        while len(self.running) < self.settings.jobs.processes:
            claim = self._claim()
            if claim is None:
                break
            with self._about(claim):
                started += self._start(claim)
        return started

    def collect(self, timeout: float) -> int:
        """Store, or continue with, results that arrive within `timeout` s; the number of jobs finished or failed."""
        done = wait(self.running, timeout, FIRST_COMPLETED).done if self.running else ()
        finished = 0
        for future in done:
            job = self.running[future]
            with self._about(job.claim), job.trace.within():
                finished += self._take(future, job)
            del self.running[
                future
            ]  # only now: while the database does not answer, the result is kept and stored later
            if job.note:
                job.note.erase()
        return finished

    def store_progress(self) -> None:
        """Store the progress that computations report."""
        for future, job in list(self.running.items()):
            if news := job.news:
                self._tell(job, news)
                self.running[future] = replace(job, reported=news)

    def hold(self) -> None:
        """Extend leases in time; drop claims of jobs that other workers claimed."""
        elapsed, now = self.timer(), self.clock()
        if self.extended_at is not None and elapsed - self.extended_at < self.settings.jobs.lease / 3:
            return
        with self.sessions.begin() as session:
            process_leases.hold(session, WORKING, self.holder, now, self._lease, self.trouble)
        self.extended_at = elapsed
        for future, job in list(self.running.items()):
            with self.sessions.begin() as session:
                is_valid = queue.extend(session, job.claim, now, self._lease)
            if not is_valid:
                log.warning("job %d was claimed by another worker", job.claim.job_id)
                future.cancel()
                del self.running[future]

    def stop_cancelled(self) -> None:
        """Stop cancelled jobs, and jobs that exceed the time limit: that attempt counts as failed."""
        now = self.timer()
        if not self.running or now - self.cancelled_checked_at < HEED:
            return
        self.cancelled_checked_at = now
        limit = self.settings.jobs.time_limit
        overdue = {future for future, job in self.running.items() if now - job.started > limit and not future.done()}
        with reading(self.sessions)() as session:
            running = queue.still_running(session, [job.claim for job in self.running.values()])
        cancelled = {future for future, job in self.running.items() if job.claim.job_id not in running}
        for future in overdue - cancelled:
            self._record_failure(self.running[future].claim, JobTimeoutError(limit))
        self._stop(overdue | cancelled)

    def put_back(self) -> None:
        """Release every claim, so that other workers need not wait for the leases to expire."""
        try:
            for job in self.running.values():
                with self.sessions.begin() as session:
                    queue.release(session, job.claim)
            with self.sessions.begin() as session:
                process_leases.give_up(session, WORKING, self.holder)
        except OperationalError as error:
            log.warning("the claims were not returned and will lapse by themselves: %s", problem(error) or error.orig)
        self.running.clear()

    def _stop(self, futures: Collection[Future[Any]]) -> None:
        """End these computations; others go on."""
        if not futures:
            return
        stopped = [self.running.pop(future) for future in futures]
        log.warning("stopped computing %s", ", ".join(f"job {job.claim.job_id}" for job in stopped))
        for job in stopped:
            if job.note:
                job.note.erase()
        executor = self.executors()
        for future in futures:
            if not future.cancel() and not future.done() and isinstance(executor, JobExecutor):
                executor.abandon(future)
                self.is_warm, self.first_warmed = False, None

    def _notice_trouble(self) -> bool:
        """True while the executor cannot compute; a change is stored with the next leases, which are due then."""
        executor = self.executors()
        found = executor.trouble() if isinstance(executor, JobExecutor) else None
        if found != self.trouble:
            self.trouble, self.extended_at = found, None
        return found is not None

    def _about(self, claim: Claim) -> AbstractContextManager[None]:
        """Lines of the log within are about this job."""
        return logs.about(job=claim.job_id, kind=claim.kind, event=claim.event_id, model=claim.model_id)

    @property
    def _lease(self) -> timedelta:
        return timedelta(seconds=self.settings.jobs.lease)

    def _claim(self) -> Claim | None:
        with self.sessions.begin() as session:
            return queue.claim(session, self.clock(), self._lease)

    def _start(self, claim: Claim) -> bool:
        """Read the inputs of the job and start its first stage; False if that failed."""
        trace = Work.begun("job", job=claim.job_id, kind=claim.kind, event=claim.event_id, model=claim.model_id)
        try:
            with trace.within():
                kind = self.kinds[claim.kind]
                with reading(self.sessions)() as session:
                    inputs = kind.inputs(session, claim, self.settings)
                self._submit(Running(claim, inputs, kind.stages(inputs), trace=trace))
        except OperationalError:
            raise
        except StoreAwayError as error:
            trace.end(error)
            log.warning("job %d waits for its lease to lapse: %s", claim.job_id, error)
            return False
        except LostComputationError as error:
            self._begin_again(claim, trace, error)
            return False
        except Exception as error:  # as below, the worker survives a bug
            trace.end(error)
            self._record_failure(claim, error)
            return False
        return True

    def _take(self, future: Future[Any], job: Running) -> bool:
        """Continue with the next stage, or store the result; True if the job has left this worker."""
        try:
            result = future.result()
            job.trace.end_stage()
            if job.stage.key is not None:
                self.kept.add(job.stage.key, result)
            after = replace(job, results=(*job.results, result))
            if len(after.results) < len(after.stages):
                self._submit(after)
                return False
            self._write(after)
            job.trace.end()
        except OperationalError:
            raise
        except LostComputationError as error:
            self._begin_again(job.claim, job.trace, error)
        except Exception as error:
            job.trace.end(error)
            self._record_failure(job.claim, error)
        return True

    def _submit(self, job: Running) -> None:
        """Start the next stage whose result is not kept, after storing that it starts."""
        job = self._with_kept_results(job)
        name = f"{job.claim.job_id}-{job.claim.token}-{len(job.results)}"
        note = Note(self.notes / name) if self.notes else None
        self._tell(job, Report(job.stage.doing))
        job.trace.stage(job.stage.doing)
        with without_stop_signals():
            future = self.executors().submit(job.stage.function, *job.stage.arguments(job.results, note or silent))
        self.running[future] = replace(job, note=note, reported=None)

    def _with_kept_results(self, job: Running) -> Running:
        """The job past those of its next stages, but for the last, whose results are kept."""
        while len(job.results) + 1 < len(job.stages) and (key := job.stage.key) is not None:
            result = self.kept.find(key)
            if result is None:
                break
            job = replace(job, results=(*job.results, result))
        return job

    def _tell(self, job: Running, report: Report) -> None:
        done, stages, share = len(job.results), len(job.stages), job.share(report.share)
        with self.sessions.begin() as session:
            queue.report_progress(session, job.claim, done, stages, report.doing, share)

    def _write(self, job: Running) -> None:
        with self.sessions.begin() as session:
            if queue.finish(session, job.claim, self.clock()):
                self.kinds[job.claim.kind].store(session, job.claim, job.inputs, job.results, self.clock())

    def _begin_again(self, claim: Claim, trace: Work, error: LostComputationError) -> None:
        """Return a job to the queue whose computation was lost; it has not failed."""
        trace.end(error)
        log.warning("job %d begins again: %s", claim.job_id, error)
        with self.sessions.begin() as session:
            queue.release(session, claim)

    def _record_failure(self, claim: Claim, error: Exception) -> None:
        """Mark a rejected job at once; try again after a bug or a killed process, and mark the job as failed after the
        last attempt."""
        if isinstance(error, CoreError):
            with self.sessions.begin() as session:
                queue.refuse(session, claim, str(error), self.clock())
            return
        log.error("attempt %d at job %d failed", claim.failures + 1, claim.job_id, exc_info=error)
        text = "".join(format_exception(error))
        with self.sessions.begin() as session:
            queue.fail(session, claim, text, self.clock(), self.settings.jobs.attempts)
