"""Executors of jobs: processes of this machine, or a Dask cluster."""

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path
from typing import Any

from service.jobs.child import begin
from service.settings import Settings
from service.threads import ONE_THREAD
from service.user_effects import add_user_effects

Executors = Callable[[], Executor]
"""A function that returns a live executor; after a crash, a new one."""


def executors(settings: Settings) -> Executors:
    """The executors that the settings select."""
    if settings.jobs.executor == "dask":
        return dask_cluster(settings.jobs.dask_address, settings.effects_folder)
    return local_processes(settings.jobs.workers, settings.effects_folder)


def local_processes(count: int, effects_folder: Path | None = None) -> Executors:
    """Processes of this machine with the installation's own effects, started when needed and again after a crash.

    An idle process stays, with all that it has loaded.
    """
    from loky import get_reusable_executor  # starts machinery of its own, so only where jobs are done

    return lambda: get_reusable_executor(
        max_workers=count, timeout=None, env=ONE_THREAD, initializer=begin, initargs=(os.getpid(), effects_folder)
    )


@contextmanager
def without_interrupts() -> Iterator[None]:
    """Start processes within this context without SIGINT, so that Ctrl-C, which reaches the whole terminal, leaves
    them alone.

    Otherwise an idle or starting process would die, break the pool and fail a job.
    """
    resource_tracker.ensure_running()  # otherwise Python starts it within, and unmasks the signal
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # inherited by children and threads
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def is_warmed(settings: Settings) -> bool:
    """True if processes load what they need before their first job; a Dask cluster's workers are left alone."""
    return settings.jobs.warm and settings.jobs.executor == "local"


def in_processes(made: Executors, preparation: Callable[[], None], count: int) -> list[Future[None]]:
    """Prepare so many idle processes; each takes one, since a preparation takes longer than to begin it."""
    with without_interrupts():
        return [made().submit(preparation) for _ in range(count)]


def end(made: Executors, settings: Settings) -> None:
    """End the executors; running computations of local processes are abandoned, because no process would store them."""
    made().shutdown(wait=True, **({"kill_workers": True} if settings.jobs.executor == "local" else {}))


def dask_cluster(address: str | None, effects_folder: Path | None = None) -> Executors:
    """Workers of a Dask cluster; equal calls are computed each time. Own effects come from a folder of the same name
    there.

    They look for own effects in a folder of the same name, on their machine.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise RuntimeError("executor = dask needs the package distributed: pip install 'menshin[dask]'") from None
    client: Any = Client(address)
    client.register_worker_callbacks(partial(add_user_effects, effects_folder))
    return lambda: client.get_executor(pure=False)
