"""Children of a command, such as its parser and its pool's, that do not import everything anew either.

The command makes one copy of itself while it has one thread. That copy does nothing but copy itself when the command
starts a child: a process of its own, whose parent is the command (Linux's CLONE_PARENT), with the arguments,
environment, files and blocked signals that the command gave.
"""

import _posixsubprocess
import ctypes
import fcntl
import json
import os
import platform
import runpy
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from threading import Lock

CHILDREN = {"service.parsing.child": "parser", "loky.backend.popen_loky_posix": "pool child"}
"""Modules that commands start as children, and the names of such processes."""
IMPORTED = (*CHILDREN, "obspy.io.mseed.core", "core.analysis", "service.jobs.child", "loky.process_executor")
"""Modules that they import."""
NURSERY = "nursery"
"""Name of the process that children are copied from."""
LARGEST = 1 << 17
"""Bytes of a message."""
FILES = 16
"""Open files of a child at most."""
ABOVE = 500
"""Number above those of the files that a child expects."""
CLONE_PARENT, PR_SET_NAME = 0x8000, 15
CLONE = {"x86_64": 56, "aarch64": 220}
"""Number of the system call."""
LIBC = ctypes.PyDLL(None)
"""Keeps Python's lock, as `os.fork` does."""


def begin() -> None:
    """Have this process's children copied from a process that is made now. It ends with this one."""
    assert len(os.listdir("/proc/self/task")) == 1, "a copy would lack the other threads"
    mine, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    if os.fork() == 0:
        mine.close()
        name(NURSERY)
        _serve(theirs)
    theirs.close()
    started, lock = _posixsubprocess.fork_exec, Lock()

    def fork_exec(
        arguments: Sequence[bytes], executables: Sequence[bytes], close: bool, kept: Sequence[int], *more: object
    ) -> int:
        given = [os.fsdecode(one) for one in arguments]
        module = given[given.index("-m") + 1] if "-m" in given else ""
        if module not in CHILDREN:
            return int(started(arguments, executables, close, kept, *more))
        environment, (standard_input, _, _, output, _, errors, _, failure) = more[1], more[2:10]
        files = {0: standard_input, 1: output, 2: errors} | {one: one for one in kept if one != failure}
        files = {number: file for number, file in files.items() if file != -1}
        blocked = [int(one) for one in signal.pthread_sigmask(signal.SIG_BLOCK, [])]
        variables = [os.fsdecode(one) for one in environment]  # type: ignore[attr-defined]
        asked = [module, given[given.index("-m") + 2 :], variables, list(files), blocked]
        with lock:
            socket.send_fds(mine, [json.dumps(asked).encode()], list(files.values()))
            return int(mine.recv(LARGEST))

    _posixsubprocess.fork_exec = subprocess._fork_exec = fork_exec


def name(process: str) -> None:
    """Name this process."""
    LIBC.prctl(PR_SET_NAME, process.encode(), 0, 0, 0)


def _serve(messages: socket.socket) -> None:
    """Copy this process as often as its parent asks; in a copy, run what it asked for."""
    while True:
        received, files, *_ = socket.recv_fds(messages, LARGEST, FILES)
        if not received:
            os._exit(0)
        if (pid := _sibling()) == 0:
            messages.close()
            _run(json.loads(received), files)
        for file in files:
            os.close(file)
        messages.send(str(pid).encode())


def _sibling() -> int:
    """`fork`, but the copy is a child of this process's parent."""
    ctypes.pythonapi.PyOS_BeforeFork()
    pid = int(LIBC.syscall(CLONE[platform.machine()], CLONE_PARENT | signal.SIGCHLD, 0, 0, 0, 0))
    (ctypes.pythonapi.PyOS_AfterFork_Parent if pid else ctypes.pythonapi.PyOS_AfterFork_Child)()
    assert pid >= 0, "no process can be made"
    return pid


def _run(asked: tuple[str, list[str], list[str], list[int], list[int]], files: Sequence[int]) -> None:
    module, arguments, environment, numbers, blocked = asked
    name(CHILDREN[module])
    moved = [fcntl.fcntl(file, fcntl.F_DUPFD, ABOVE) for file in files]
    for file in files:
        os.close(file)
    for file, number in zip(moved, numbers, strict=True):
        os.dup2(file, number)
        os.close(file)
    os.environ.clear()
    os.environ.update(variable.split("=", 1) for variable in environment)
    signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
    sys.argv[1:] = arguments
    runpy.run_module(module, run_name="__main__", alter_sys=True)
    sys.exit()
