"""Our command as a process of its own that does not import everything anew: copied from one that has.

To import takes a command half of its processor time or more. One process imports what all commands share, and does
nothing else; each command is a copy of it (`fork`), with its own arguments, folder, environment and output, and ends as
any process of Python does. So are the children of commands, see `forked_children`. What tests kill, stop and watch is
a real process; only its imports are done.
"""

import atexit
import gc
import json
import os
import select
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from threading import Lock
from typing import BinaryIO

import forked_children
import psutil

HERE = str(Path(__file__).parent)
PROGRAM = f"import sys; sys.path.append({HERE!r}); from forked_commands import serve; serve()"
SHARED = (
    *("service.cli", "service.roles", "service.serving", "service.kinds", "service.poller", "service.jobs.worker"),
    *("service.jobs.executors", "service.analyses.loading", "service.notify.notifier", "service.records.source_poller"),
    *("service.app", *forked_children.IMPORTED),
)
"""Modules that the commands of tests, and their children, import when they run."""
LARGEST = 1 << 17
"""Bytes of a message."""


class Command(psutil.Process):
    """A running command, with the methods of a process that this one had started."""

    def __init__(self, pid: int, source: "Source") -> None:
        super().__init__(pid)
        self._source = source
        self._exit_code: int | None = None

    def wait(self, timeout: float | None = None) -> int:
        """Exit code once it has ended, minus the signal's number if one ended it.

        Raises:
            psutil.TimeoutExpired: it has not ended within so many seconds.
        """
        if self._exit_code is None:
            end = os.pidfd_open(self.pid)
            try:
                if not select.select([end], [], [], timeout)[0]:
                    raise psutil.TimeoutExpired(timeout, self.pid)
            finally:
                os.close(end)
            self._exit_code = self._source.exit_code(self.pid)
        return self._exit_code

    def poll(self) -> int | None:
        """Exit code, None while it runs."""
        try:
            return self.wait(0.0)
        except psutil.TimeoutExpired:
            return None


class Source:
    """The process that the commands are copied from. It ends with this one.

    Args:
        environment: of the process.
    """

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._messages, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._lock = Lock()
        self.environment = dict(environment)
        with theirs:
            self._process = subprocess.Popen(
                [sys.executable, "-c", PROGRAM], stdin=theirs, stdout=subprocess.DEVNULL, env=environment
            )
        self.pid = self._process.pid
        atexit.register(self.end)

    def start(
        self, arguments: Sequence[str], folder: Path, environment: Mapping[str, str], output: BinaryIO, errors: BinaryIO
    ) -> Command:
        """A new command in a folder."""
        asked = [list(arguments), str(folder), dict(environment)]
        return Command(self._answer(asked, output.fileno(), errors.fileno()), self)

    def exit_code(self, pid: int) -> int:
        """Exit code of a command that has ended; its number may then be another process's."""
        return os.waitstatus_to_exitcode(self._answer(pid))

    def _answer(self, asked: object, *files: int) -> int:
        with self._lock:
            socket.send_fds(self._messages, [json.dumps(asked).encode()], files)
            received = self._messages.recv(LARGEST)
        assert received, "the process that commands are copied from has ended"
        return int(received)

    def end(self) -> None:
        """End the process that commands are copied from."""
        self._messages.close()
        self._process.wait(10)


@cache
def source() -> Source:
    """One for all tests of this process."""
    return Source({name: value for name, value in os.environ.items() if not name.startswith("MENSHIN_")})


def serve() -> None:
    """Import what commands share, and be copied as often as is asked for on the standard input."""
    for name in SHARED:
        import_module(name)
    sys.path.remove(HERE)
    import_module("service.analyses.loading").load()
    gc.collect()
    gc.freeze()
    assert len(os.listdir("/proc/self/task")) == 1, "a copy would lack the other threads"
    with socket.socket(fileno=os.dup(0)) as messages:
        asked = _copied(messages)
    if asked is not None:
        _run(*asked)


def _copied(messages: socket.socket) -> tuple[list[str], str, dict[str, str]] | None:
    """In a copy what it was asked to run; in the original None, when nobody asks any more."""
    while True:
        received, files, *_ = socket.recv_fds(messages, LARGEST, 2)
        if not received:
            return None
        asked = json.loads(received)
        if isinstance(asked, int):  # the number of a copy that has ended
            answer = os.waitpid(asked, 0)[1]
        elif (answer := os.fork()) == 0:
            for number, file in enumerate((os.open(os.devnull, os.O_RDONLY), *files)):
                os.dup2(file, number)
                os.close(file)
            return tuple(asked)
        for file in files:
            os.close(file)
        messages.send(str(answer).encode())


def _run(arguments: list[str], folder: str, environment: dict[str, str]) -> None:
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv[1:] = arguments
    forked_children.begin()
    import_module("service.cli").app()
