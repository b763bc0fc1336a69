"""Where analyses are computed: processes of this machine, or a Dask cluster."""

import os
from collections.abc import Callable
from concurrent.futures import Executor
from threading import Thread
from time import sleep
from typing import Any

from service.settings import Settings

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Many processes with many BLAS threads each fight for the cores: 16 decompositions took ten times as long."""

Executors = Callable[[], Executor]
"""Gives an executor that is alive: after a crash, a new one."""


def executors(settings: Settings) -> Executors:
    """The executors that the settings ask for."""
    return dask_cluster(settings.dask_address) if settings.executor == "dask" else local_processes(settings.workers)


def local_processes(count: int) -> Executors:
    """Processes of this machine, started when first needed and again after one was killed."""
    from loky import get_reusable_executor  # starts machinery of its own: only where work is done

    return lambda: get_reusable_executor(
        max_workers=count, timeout=600, env=ONE_THREAD, initializer=end_with, initargs=(os.getpid(),)
    )


def end_with(parent: int) -> None:
    """Let this process end when the one that started it was killed: nobody waits for its results any more."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(1.0)
        os._exit(1)

    Thread(target=watch, daemon=True, name="end with the parent").start()


def dask_cluster(address: str | None) -> Executors:
    """Workers of a Dask cluster; every call is computed, however like an earlier one it looks."""
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise RuntimeError("executor = dask needs the package distributed: pip install 'menshin[dask]'") from None
    client: Any = Client(address)
    return lambda: client.get_executor(pure=False)
