"""Executors of jobs: processes of this machine, or a Dask cluster."""

import itertools
import os
import signal
from abc import abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from service.jobs.child import begin
from service.process import ONE_THREAD
from service.settings import Settings

P = ParamSpec("P")
T = TypeVar("T")
Executors = Callable[[], Executor]
"""A function that returns a live executor; after a crash, a new one."""


class LostComputationError(Exception):
    """A computation was lost by no fault of its job, which may begin again elsewhere."""


class JobExecutor(Executor):
    """An executor that can abandon a computation, and says when it cannot compute."""

    def trouble(self) -> str | None:
        """Obstacle to computing, and its remedy; None if there is none."""
        return None

    @abstractmethod
    def abandon(self, future: Future[Any]) -> None:
        """End a computation whose result nobody needs; others go on."""


@dataclass(slots=True)
class _Process:
    """One process with what it was given."""

    made: Executor | None = None
    """None: not started yet."""
    given: set[Future[Any]] = field(default_factory=set)
    used: int = 0
    """Number of the latest computation that it was given."""

    @property
    def undone(self) -> int:
        return sum(not future.done() for future in self.given)


class Processes(JobExecutor):
    """Processes of this machine with the installation's own effects, started when needed and again after a crash.

    Each has a queue of its own, so that one that dies takes no computation of another along. An idle process stays,
    with all that it has loaded.
    """

    def __init__(self, count: int, effects_folder: Path | None = None) -> None:
        self._processes = [_Process() for _ in range(count)]
        self._numbers = itertools.count(1)
        self._effects_folder = effects_folder

    def submit(self, fn: Callable[P, T], /, *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Compute in the process with least to do, among equals in that which has had nothing for longest."""
        process = min(self._processes, key=lambda one: (one.undone, one.used))
        process.used = next(self._numbers)
        try:
            future = self._started(process).submit(fn, *args, **kwargs)
        except BrokenExecutor:  # it died while it was idle
            self._kill(process)
            future = self._started(process).submit(fn, *args, **kwargs)
        process.given = {one for one in process.given if not one.done()} | {future}
        return future

    def abandon(self, future: Future[Any]) -> None:
        """Kill the process that computes; it is started again when needed."""
        for process in self._processes:
            if future in process.given and not future.done():
                self._kill(process)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Kill all processes: nobody would store their results. They are started again when needed."""
        for process in self._processes:
            self._kill(process)

    def _started(self, process: _Process) -> Executor:
        from loky import ProcessPoolExecutor  # starts machinery of its own, so only where jobs are done

        if process.made is None:
            begun = (os.getpid(), self._effects_folder)
            process.made = ProcessPoolExecutor(1, timeout=None, env=ONE_THREAD, initializer=begin, initargs=begun)
        return process.made

    @staticmethod
    def _kill(process: _Process) -> None:
        if process.made is not None:
            process.made.shutdown(wait=True, kill_workers=True)  # type: ignore[call-arg]  # loky's own argument
        process.made, process.given = None, set()


def local_processes(count: int, effects_folder: Path | None = None) -> Executors:
    """Processes of this machine."""
    processes = Processes(count, effects_folder)
    return lambda: processes


@contextmanager
def without_stop_signals() -> Iterator[None]:
    """Start processes within this context without the signals that stop the service, which ends them itself.

    Ctrl-C reaches every process of the terminal, and systemd's SIGTERM every process of the service. Otherwise each
    would die by it, and an attempt at its job would count as failed.
    """
    resource_tracker.ensure_running()  # otherwise Python starts it within, and unmasks the signals
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})  # inherited by children, threads
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def is_warmed(settings: Settings) -> bool:
    """True if processes load what they need before their first job; a Dask cluster's workers are left alone."""
    return settings.jobs.warm and settings.jobs.executor == "local"


def in_processes(made: Executors, preparation: Callable[[], None], count: int) -> list[Future[None]]:
    """Prepare so many idle processes; each takes one, since a preparation takes longer than to begin it."""
    with without_stop_signals():
        return [made().submit(preparation) for _ in range(count)]


def end(made: Executors) -> None:
    """End the executors; running computations are abandoned, because no process would store them."""
    made().shutdown(wait=True)
