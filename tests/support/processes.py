"""The real command in a process of its own, to be stopped and killed."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import BinaryIO

import psutil
from forked_commands import Command, source

COMMAND = (sys.executable, "-c", "from service.cli import app; app()")
READ_AT_IMPORT = ("LD_", "PYTHON", "FAKETIME", "OMP_", "NUMBA_")
"""Beginnings of variables that have effect while a process starts and imports."""


def environment(database_url: str, **more: str) -> dict[str, str]:
    """For a process of ours at a database."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MENSHIN_")}
    usual = {"MENSHIN_DATABASE_URL": database_url, "MENSHIN_JOBS__WARM": "false", "OMP_NUM_THREADS": "1"}
    return kept | usual | more


def run(
    folder: Path, database_url: str, *arguments: str, before: Sequence[str] = (), **more: str
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, by way of the one `before` it."""
    given = environment(database_url, **more)
    if before:
        command = [*before, *COMMAND, *arguments]
        return subprocess.run(command, cwd=folder, env=given, capture_output=True, text=True, timeout=120)
    with TemporaryFile() as output, TemporaryFile() as errors:
        process = _started(arguments, folder, given, output, errors)
        try:
            code = process.wait(120)
        finally:
            kill_tree(process)
        written = []
        for file in (output, errors):
            file.seek(0)
            written.append(file.read().decode())
    return subprocess.CompletedProcess(arguments, code, *written)


@contextmanager
def running_command(folder: Path, database_url: str, *arguments: str, **more: str) -> Iterator[psutil.Popen | Command]:
    """A command that runs meanwhile; nothing of its process tree is left afterwards."""
    with (folder / "output").open("ab") as output:
        process = _started(arguments, folder, environment(database_url, **more), output, output)
    try:
        yield process
    finally:
        kill_tree(process)


def _started(
    arguments: Sequence[str], folder: Path, given: Mapping[str, str], output: BinaryIO, errors: BinaryIO
) -> psutil.Popen | Command:
    """A copy of a process that has imported everything, unless the environment differs in what a start heeds."""
    copied = source()
    changed = {name for name in {*given, *copied.environment} if given.get(name) != copied.environment.get(name)}
    if any(name.startswith(READ_AT_IMPORT) for name in changed):
        return psutil.Popen([*COMMAND, *arguments], cwd=folder, env=given, stdout=output, stderr=errors)
    return copied.start(arguments, folder, given, output, errors)


def kill_tree(process: psutil.Popen | Command) -> None:
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


def interrupt(process: psutil.Popen | Command, number: int = signal.SIGTERM) -> int:
    """Ask a process to end; its exit code."""
    process.send_signal(number)
    return int(process.wait(timeout=60))
