"""The parser's own process: `python -P -m service.parsing.child <bytes of memory>`; it ends with its standard input.

It bounds itself before it reads anything from outside, and has neither the settings nor the secrets of the service.
"""

import fcntl
import os
import resource
import select
import signal
import sys
import traceback
from math import ceil
from typing import Any, BinaryIO

import obspy  # noqa: F401  the readers import it at their first file, when time and memory are limited

from service.formats import FormatError, read
from service.formats.fdsn_xml import origins
from service.formats.waveforms import covered
from service.parsing import wire

LARGEST_REQUEST = 2**32  # bytes; the settings bound what is fetched


def main() -> None:
    """Answer one request after the other."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints must not get among the answers
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)  # meant for the service, which then closes our standard input
    _bound(memory=int(sys.argv[1]))
    while True:
        try:
            request, blocks = wire.receive(requests, LARGEST_REQUEST)
        except EOFError:
            return
        _answer(requests, answers, request, bytes(blocks[0]))


def _answer(requests: BinaryIO, answers: BinaryIO, request: wire.Json, data: bytes) -> None:
    _deadline(request["seconds"])
    _end_with_parent(requests, True)
    try:
        message, blocks = _result(request, data)
    except FormatError as error:
        message, blocks = wire.written_refusal(error), []
    except MemoryError:
        message, blocks = {"died": "memory"}, []
    except Exception as error:  # a bug of a reader's, which the service reports as one
        text = "".join(traceback.format_exception(error))
        message, blocks = {"bug": f"{type(error).__name__}: {error}", "traceback": text[-4000:]}, []
    _end_with_parent(requests, False)
    signal.setitimer(signal.ITIMER_REAL, 0)
    wire.send(answers, message, blocks)


def _result(request: wire.Json, data: bytes) -> tuple[wire.Json, list[Any]]:
    if request["call"] == "covered":
        pieces = [[piece.channel, piece.start, piece.end, piece.interval.total_seconds()] for piece in covered(data)]
        return {"pieces": pieces}, []
    if request["call"] == "origins":
        return {"origins": [{"id": one.id, "time": one.time} for one in origins(data)]}, []
    contents = read(request["name"], data, wire.read_gains(request["gains"]))
    message, blocks = wire.written_contents(contents)
    return {"contents": message}, list(blocks)


def _bound(memory: int) -> None:
    """Limit this process's memory beyond its present size, and write no core files."""
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_AS, (_address_space() + memory,) * 2)


def _address_space() -> int:
    """Bytes in use; 0 where the system does not report them."""
    try:
        with open("/proc/self/statm", encoding="ascii") as statm:
            return int(statm.read().split()[0]) * resource.getpagesize()
    except OSError:
        return 0


def _deadline(seconds: float) -> None:
    """Have the system kill this process after so much processor time, or twice that on the clock."""
    used = sum(resource.getrusage(resource.RUSAGE_SELF)[:2])
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (ceil(used + seconds), hard))
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, 2 * seconds)


def _end_with_parent(requests: BinaryIO, wanted: bool) -> None:
    """Have the system kill this process if the service ends during its work (SIGIO on a closed pipe)."""
    flags = fcntl.fcntl(requests, fcntl.F_GETFL)
    fcntl.fcntl(requests, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(requests, fcntl.F_SETFL, flags | os.O_ASYNC if wanted else flags & ~os.O_ASYNC)
    poll = select.poll()
    poll.register(requests, select.POLLHUP)
    if wanted and poll.poll(0):  # it ended before the signal was set
        raise SystemExit


if __name__ == "__main__":
    main()
