"""`menshin demo` as its spectator runs it: a process of its own, what it says, and its end."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import httpx
import psutil
import pytest

from service.demo.stage import DATABASE

PATIENCE = 120.0  # s: what the demonstration promises for its first page, with this machine's other work beside it
PAUSE = 1 / 500
"""Pause between two requests, as a share of the patience: each takes processor time from the demonstration."""
ADDRESS = re.compile(r"http://127\.0\.0\.1:\d+/(?!fdsnws)")
Answer = TypeVar("Answer")


class Demo:
    """A running demonstration and its printed text."""

    def __init__(self, folder: Path, printed: Path, *more: str, **settings: str) -> None:
        self.printed = printed
        command = [str(Path(sys.executable).with_name("menshin")), "demo", "--folder", str(folder), "--port", "0"]
        with printed.open("w") as output:
            self.process = subprocess.Popen(
                [*command, *more],
                cwd=printed.parent,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, "COLUMNS": "200", "OMP_NUM_THREADS": "1", **settings},
                start_new_session=True,
            )

    def address(self) -> str:
        """Address of its pages and its API, once it has printed it."""
        found = self.until(lambda: ADDRESS.search(self.printed.read_text()))
        return found[0].rstrip("/")

    def key(self) -> str:
        """A new admin's key, made as its operator makes one; from then on the pages and the API take a key."""
        kept = self.until(lambda: re.search(r"kept in (.+)", self.printed.read_text()))[1]
        command = [str(Path(sys.executable).with_name("menshin")), "key", "create", "operator", "--role", "admin"]
        environment = {**os.environ, "MENSHIN_DATABASE_URL": f"sqlite:///{Path(kept) / DATABASE}"}
        done = subprocess.run(
            command, cwd=self.printed.parent, env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    def events(
        self, address: str, count: int, patience: float = PATIENCE, key: str | None = None
    ) -> list[dict[str, object]]:
        """The events once so many are settled."""
        service = httpx.Client(base_url=address, headers={} if key is None else {"X-API-Key": key})

        def settled() -> list[dict[str, object]] | None:
            found = service.get("/api/v1/buildings/DEMO/events", params={"limit": 100}).json()["items"]
            done = [event for event in found if event["state"] in ("analysed", "refused")]
            return found if len(done) >= count else None

        with service:
            return self.until(settled, patience)

    def until(self, question: Callable[[], Answer | None], patience: float = PATIENCE) -> Answer:
        """An answer that is true, which must come within so many seconds while the demonstration runs."""
        end = time.monotonic() + patience
        while time.monotonic() < end:
            assert self.process.poll() is None, self.printed.read_text()
            try:
                if answer := question():
                    return answer
            except httpx.TransportError:
                pass
            time.sleep(max(0.2, patience * PAUSE))
        pytest.fail(f"nothing within {patience:g} s; it said:\n{self.printed.read_text()}")


@contextmanager
def demo(folder: Path, printed: Path, *more: str, **settings: str) -> Iterator[Demo]:
    """One with its own folder and options, and settings as variables of the environment; it has ended afterwards."""
    running = Demo(folder, printed, *more, **settings)
    try:
        yield running
    finally:
        if running.process.poll() is None:
            running.process.kill()
        running.process.wait()


def seconds_to_end(running: Demo) -> float:
    """s that the demonstration takes to end after Ctrl-C, which reaches every process of its group."""
    begin = time.monotonic()
    os.killpg(running.process.pid, signal.SIGINT)
    assert running.process.wait(timeout=20) == 0, running.printed.read_text()
    return time.monotonic() - begin


def surviving_processes(group: int) -> list[psutil.Process]:
    """Processes of the group that still live after the moment that a child needs to see that its parent is gone."""
    members = [process for process in psutil.process_iter() if _group(process) == group]
    return psutil.wait_procs(members, timeout=5.0)[1]


def _group(process: psutil.Process) -> int | None:
    try:
        return None if process.status() == psutil.STATUS_ZOMBIE else os.getpgid(process.pid)
    except (ProcessLookupError, psutil.NoSuchProcess):
        return None
