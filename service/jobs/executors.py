"""Where analyses are computed: processes of this machine, or a Dask cluster."""

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from functools import partial
from multiprocessing import resource_tracker
from pathlib import Path
from threading import Thread
from time import sleep
from typing import Any

from service.settings import Settings
from service.user_effects import add_user_effects

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Many processes with many BLAS threads each fight for the cores: 16 decompositions took ten times as long."""

Executors = Callable[[], Executor]
"""Gives an executor that is alive: after a crash, a new one."""


def executors(settings: Settings) -> Executors:
    """The executors that the settings ask for."""
    if settings.jobs.executor == "dask":
        return dask_cluster(settings.jobs.dask_address, settings.effects_folder)
    return local_processes(settings.jobs.workers, settings.effects_folder)


def local_processes(count: int, effects_folder: Path | None = None) -> Executors:
    """Processes of this machine that know own effects, started when first needed and again after one was killed."""
    from loky import get_reusable_executor  # starts machinery of its own: only where work is done

    return lambda: get_reusable_executor(
        max_workers=count, timeout=600, env=ONE_THREAD, initializer=_begin, initargs=(os.getpid(), effects_folder)
    )


@contextmanager
def out_of_reach_of_interrupts() -> Iterator[None]:
    """Processes that are begun within never see Ctrl-C, which reaches all of a terminal: who began them ends them.

    Else one that waits for work, or still starts, dies of it and breaks the pool, and a job is said to have failed.
    """
    resource_tracker.ensure_running()  # else Python starts it within, and takes the signal off the mask
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})  # which children and threads inherit
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(parent: int, effects_folder: Path | None) -> None:
    end_with(parent)
    add_user_effects(effects_folder)


def end_with(parent: int) -> None:
    """Let this process end when the one that started it was killed: nobody waits for its results any more."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(1.0)
        os._exit(1)

    Thread(target=watch, daemon=True, name="end with the parent").start()


def end(made: Executors, settings: Settings) -> None:
    """Let them end; what processes of this machine still compute is left off, for nobody will write it."""
    made().shutdown(wait=True, **({"kill_workers": True} if settings.jobs.executor == "local" else {}))


def dask_cluster(address: str | None, effects_folder: Path | None = None) -> Executors:
    """Workers of a Dask cluster; every call is computed, however like an earlier one it looks.

    They look for own effects in a folder of the same name, on their machine.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise RuntimeError("executor = dask needs the package distributed: pip install 'menshin[dask]'") from None
    client: Any = Client(address)
    client.register_worker_callbacks(partial(add_user_effects, effects_folder))
    return lambda: client.get_executor(pure=False)
