"""Where analyses are computed: processes of this machine, or a Dask cluster."""

import os
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from threading import Thread
from time import sleep
from typing import Any

from service.own_effects import add_own_effects
from service.settings import Settings

ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Many processes with many BLAS threads each fight for the cores: 16 decompositions took ten times as long."""

Executors = Callable[[], Executor]
"""Gives an executor that is alive: after a crash, a new one."""


def executors(settings: Settings) -> Executors:
    """The executors that the settings ask for."""
    if settings.executor == "dask":
        return dask_cluster(settings.dask_address, settings.effects_folder)
    return local_processes(settings.workers, settings.effects_folder)


def local_processes(count: int, effects_folder: Path | None = None) -> Executors:
    """Processes of this machine that know own effects, started when first needed and again after one was killed."""
    from loky import get_reusable_executor  # starts machinery of its own: only where work is done

    return lambda: get_reusable_executor(
        max_workers=count, timeout=600, env=ONE_THREAD, initializer=_begin, initargs=(os.getpid(), effects_folder)
    )


def _begin(parent: int, effects_folder: Path | None) -> None:
    end_with(parent)
    add_own_effects(effects_folder)


def end_with(parent: int) -> None:
    """Let this process end when the one that started it was killed: nobody waits for its results any more."""

    def watch() -> None:
        while os.getppid() == parent:
            sleep(1.0)
        os._exit(1)

    Thread(target=watch, daemon=True, name="end with the parent").start()


def dask_cluster(address: str | None, effects_folder: Path | None = None) -> Executors:
    """Workers of a Dask cluster; every call is computed, however like an earlier one it looks.

    They look for own effects in a folder of the same name, on their machine.
    """
    try:
        from distributed import Client
    except ModuleNotFoundError:
        raise RuntimeError("executor = dask needs the package distributed: pip install 'menshin[dask]'") from None
    client: Any = Client(address)
    client.register_worker_callbacks(partial(add_own_effects, effects_folder))
    return lambda: client.get_executor(pure=False)
