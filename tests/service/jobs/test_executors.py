"""The processes that compute: signals that stop the service, and reach them too, take no work along."""

import os
import signal
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from pathlib import Path
from threading import Event, Thread

import psutil
import pytest

from service.jobs.executors import end, local_processes, without_stop_signals
from service.settings import Settings

SETTINGS = Settings(workers=1)


@contextmanager
def sent_all_the_time(number: signal.Signals) -> Iterator[list[int]]:
    """Send the signal to every process of the pool, from its first moment on; the numbers of those reached."""
    done, reached = Event(), list[int]()

    def send() -> None:
        while not done.wait(0.01):
            for child in psutil.Process().children(recursive=True):
                try:
                    if "loky.backend.popen" in " ".join(child.cmdline()):
                        child.send_signal(number)
                        reached.append(child.pid)
                except psutil.NoSuchProcess:
                    pass

    thread = Thread(target=send)
    thread.start()
    try:
        yield reached
    finally:
        done.set()
        thread.join()


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["of Ctrl-C", "of systemd"])
def test_no_signal_that_stops_the_service_ends_a_process_that_computes(number: signal.Signals) -> None:
    """Neither while it starts, nor while it waits for work, nor in the middle of it."""
    made = local_processes(SETTINGS.jobs.processes)
    try:
        with sent_all_the_time(number) as reached:
            for _ in range(3):
                with without_stop_signals():
                    future = made().submit(os.getpid)
                assert future.result(60) in reached
                assert not Event().wait(0.3)  # idle
        assert number not in signal.pthread_sigmask(signal.SIG_BLOCK, ()), "we ourselves hear it again"
    finally:
        end(made)


def test_a_process_that_is_killed_takes_only_its_own_computation_along(tmp_path: Path) -> None:
    os.mkfifo(gate := tmp_path / "gate")  # whoever reads it waits for somebody who writes
    made = local_processes(2)
    try:
        computing, dying = made().submit(gate.read_bytes), made().submit(os._exit, 9)
        assert isinstance(dying.exception(60), BrokenExecutor)
        others = {made().submit(os.getpid).result(60) for _ in range(2)}
        assert len(others) == 1, "a new process, while the other computes"
        assert not computing.done()
        gate.write_bytes(b"open")
        assert computing.result(60) == b"open"
    finally:
        end(made)
