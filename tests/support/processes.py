"""The real command in a process of its own, to be stopped and killed."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import psutil

COMMAND = (sys.executable, "-c", "from service.cli import app; app()")


def environment(database_url: str, **more: str) -> dict[str, str]:
    """For a process of ours at a database."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MENSHIN_")}
    usual = {"MENSHIN_DATABASE_URL": database_url, "MENSHIN_JOBS__WARM": "false", "OMP_NUM_THREADS": "1"}
    return kept | usual | more


def run(
    folder: Path, database_url: str, *arguments: str, before: Sequence[str] = (), **more: str
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, by way of the one `before` it."""
    command = [*before, *COMMAND, *arguments]
    return subprocess.run(
        command, cwd=folder, env=environment(database_url, **more), capture_output=True, text=True, timeout=120
    )


@contextmanager
def running_command(folder: Path, database_url: str, *arguments: str, **more: str) -> Iterator[psutil.Popen]:
    """A command that runs meanwhile; nothing of its process tree is left afterwards."""
    command = [*COMMAND, *arguments]
    with (folder / "output").open("ab") as output:
        process = psutil.Popen(command, cwd=folder, env=environment(database_url, **more), stdout=output, stderr=output)
    try:
        yield process
    finally:
        kill_tree(process)


def kill_tree(process: psutil.Popen) -> None:
    """SIGKILL for a process of ours and all that it started."""
    try:
        tree = [process, *process.children(recursive=True)]
    except psutil.NoSuchProcess:
        tree = []
    for member in tree:
        try:
            member.kill()
        except psutil.NoSuchProcess:
            continue
    process.wait()


def interrupt(process: psutil.Popen, number: int = signal.SIGTERM) -> int:
    """Ask a process to end; its exit code."""
    process.send_signal(number)
    return int(process.wait(timeout=60))
