"""Commands of the service and a Dask cluster, as processes of this machine, and the processor time that they use."""

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager

import psutil

from benchmarks.city import processor_time
from service.demo.server import free_port

COMMAND = (sys.executable, "-c", "from service.cli import app; app()")
TO_END = 60.0
"""s that a process has to end before it is killed."""
TO_COME = 60
"""s that the workers of a Dask cluster have to reach its scheduler."""


def run(url: str, *arguments: str, **settings: str) -> float:
    """Run a command of the service to its end; s of processor time of its processes."""
    before = _of_ended()
    with tempfile.TemporaryDirectory(prefix="menshin-benchmark-") as folder:
        command, environment = [*COMMAND, *arguments], _environment(url, settings)
        subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)
    return _of_ended() - before


@contextmanager
def running(url: str, *arguments: str, **settings: str) -> Iterator[psutil.Process]:
    """A command of the service that runs meanwhile."""
    with _started([*COMMAND, *arguments], _environment(url, settings)) as process:
        yield process


@contextmanager
def dask_cluster(workers: int) -> Iterator[tuple[str, Sequence[psutil.Process]]]:
    """A scheduler on the loopback and so many workers of one thread, each in a process of its own without settings.

    Yields:
        The scheduler's address and the processes, once all workers have reached it.
    """
    from distributed import Client

    address = f"tcp://127.0.0.1:{free_port(0)}"
    host, port = address.removeprefix("tcp://").split(":")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("MENSHIN_")}
    with ExitStack() as stack:

        def start(module: str, *arguments: str) -> psutil.Process:
            command = [sys.executable, "-m", f"distributed.cli.{module}", *arguments, "--no-dashboard"]
            return stack.enter_context(_started(command, environment))

        single = ("--host", host, "--nthreads", "1", "--no-nanny")
        processes = [start("dask_scheduler", "--host", host, "--port", port)]
        processes += [start("dask_worker", address, *single) for _ in range(workers)]
        with Client(address, timeout=TO_COME, set_as_default=False) as client:
            client.wait_for_workers(workers, timeout=TO_COME)
        yield address, processes


def used(processes: Iterable[psutil.Process]) -> float:
    """s of processor time of processes and their children."""
    return sum(processor_time(one) for one in processes)


def busy() -> float:
    """s of processor time that this machine has used for all its processes."""
    times = psutil.cpu_times()
    return float(sum(times) - times.idle - times.iowait)


def _of_ended() -> float:
    """s of processor time of this process's children that have ended, and of theirs."""
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    return ended.ru_utime + ended.ru_stime


def _environment(url: str, settings: dict[str, str]) -> dict[str, str]:
    """Variables for a command at a database; names of settings as those of variables without `MENSHIN_`."""
    return os.environ | {"MENSHIN_DATABASE_URL": url} | {f"MENSHIN_{name}": value for name, value in settings.items()}


@contextmanager
def _started(command: Sequence[str], environment: dict[str, str]) -> Iterator[psutil.Process]:
    """A process in a folder of its own; it is asked to end afterwards."""
    with tempfile.TemporaryDirectory(prefix="menshin-benchmark-") as folder:
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        process = psutil.Popen(command, cwd=folder, env=environment, **quiet)
        try:
            yield process
        finally:
            children = process.children(recursive=True) if process.is_running() else []
            process.terminate()
            _, left = psutil.wait_procs([process, *children], timeout=TO_END)
            for one in left:
                one.kill()
            process.wait()
