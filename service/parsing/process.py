"""The service's side of the parser: a warm child process, killed and replaced when a file exceeds its limits."""

import atexit
import logging
import os
import signal
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from threading import BoundedSemaphore, Lock, Timer

from service.formats import Contents, Gain
from service.formats.fdsn_xml import Origin
from service.formats.waveforms import Piece
from service.parsing import wire
from service.process import ONE_THREAD
from service.settings import Settings

log = logging.getLogger(__name__)

AT_ONCE = 2
"""Parsers; each has ObsPy in memory."""
INHERITED = ("PATH", "HOME", "LANG", "LC_ALL", "TMPDIR", "LD_LIBRARY_PATH", "PYTHONPATH", "SSL_CERT_FILE")
"""Environment variables passed on; the parser needs none of the service's passwords."""
START_TIME = 60.0  # s that a new parser may take to import what it needs
OUT_OF_TIME = {signal.SIGXCPU, signal.SIGALRM}


@dataclass(frozen=True, slots=True)
class Limits:
    """Limits for one file."""

    seconds: float
    """s of processor time; twice as much on the clock."""
    memory: int
    """Bytes, beyond the parser's own."""


def limits(settings: Settings) -> Limits:
    """The limits in the settings."""
    return Limits(settings.parser.time_limit, settings.parser.memory_limit)


class ParserDiedError(Exception):
    """A file exceeded a limit of its parser; the message names the limit."""


class _StoppedError(ParserDiedError):
    """The child was told that the service had ended, which it had not.

    The system sends the child this signal whenever something happens at the pipe of its requests, and may send that of
    our last write after the child has read it all and has asked for signals.
    """


class ParserFailedError(Exception):
    """A reader has a bug."""


def read(name: str, data: bytes, gains: Mapping[str, Gain], limits: Limits) -> Contents:
    """The contents of a file, or of a zip archive of files: `formats.read` within limits.

    Raises:
        FormatError: the file cannot be used.
        ParserDiedError: the file is too much for its parser.
        ParserFailedError: a bug of a reader.
    """
    request = {"call": "read", "name": name, "gains": wire.written_gains(gains)}
    message, blocks = _exchange(request, name, data, limits)
    return wire.read_contents(message["contents"], blocks)


def covered(name: str, data: bytes, limits: Limits) -> tuple[Piece, ...]:
    """The pieces of waveforms in a file, within limits.

    Raises:
        FormatError, ParserDiedError, ParserFailedError: as `read`.
    """
    message, _ = _exchange({"call": "covered"}, name, data, limits)
    moment = datetime.fromisoformat
    return tuple(Piece(one[0], moment(one[1]), moment(one[2]), timedelta(seconds=one[3])) for one in message["pieces"])


def origins(name: str, data: bytes, limits: Limits) -> tuple[Origin, ...]:
    """The earthquakes in a QuakeML catalogue, within limits.

    Raises:
        FormatError, ParserDiedError, ParserFailedError: as `read`.
    """
    message, _ = _exchange({"call": "origins"}, name, data, limits)
    return tuple(Origin(one["id"], datetime.fromisoformat(one["time"])) for one in message["origins"])


def _exchange(request: wire.Json, name: str, data: bytes, limits: Limits) -> tuple[wire.Json, list[bytearray]]:
    try:
        message, blocks = _answered(request, name, data, limits)
    except _StoppedError:
        message, blocks = _answered(request, name, data, limits)
    if "refusal" in message:
        raise wire.read_refusal(message)
    if "bug" in message:
        log.error("a reader failed at %s:\n%s", name, message["traceback"])
        raise ParserFailedError(message["bug"])
    return message, blocks


def _answered(request: wire.Json, name: str, data: bytes, limits: Limits) -> tuple[wire.Json, list[bytearray]]:
    with _parser(limits) as parser:
        return parser.answer({**request, "seconds": limits.seconds}, name, data)


class Parser:
    """One child process."""

    def __init__(self, limits: Limits) -> None:
        kept = {key: os.environ[key] for key in INHERITED if key in os.environ}
        self.limits = limits
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "service.parsing.child", str(limits.memory)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**kept, **ONE_THREAD},
        )
        self.is_new = True

    def answer(self, request: wire.Json, name: str, data: bytes) -> tuple[wire.Json, list[bytearray]]:
        """The child's answer.

        Raises:
            ParserDiedError: it died, or was killed, over the file.
        """
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        patience = 2 * self.limits.seconds + 1 + (START_TIME if self.is_new else 0)  # the child's own deadline is first
        late = Timer(patience, self.process.kill)
        late.daemon = True
        late.start()
        try:
            wire.send(self.process.stdin, request, [data])
            message, blocks = wire.receive(self.process.stdout, self.limits.memory)
        except (EOFError, OSError) as error:
            self.end()
            is_stopped = self.process.returncode == -signal.SIGIO
            raise (_StoppedError if is_stopped else ParserDiedError)(self._cause(name)) from error
        finally:
            late.cancel()
        self.is_new = False
        if "died" in message:
            self.end()
            raise ParserDiedError(
                f"{name} needs more than {self.limits.memory // 2**20} MiB of memory to be read; use a smaller file or "
                "a larger parser.memory_limit"
            )
        return message, blocks

    def end(self) -> None:
        """Kill the child and wait for its end."""
        self.process.kill()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with suppress(OSError):  # what was not written yet has no reader any more
                    stream.close()
        self.process.wait()

    def _cause(self, name: str) -> str:
        code = self.process.returncode
        number = signal.Signals(-code) if code is not None and code < 0 else None
        if number in OUT_OF_TIME:
            return (
                f"{name} takes more than {self.limits.seconds:g} s to be read; a smaller file, or a larger "
                f"parser.time_limit, would help"
            )
        if number == signal.SIGKILL:
            return f"the parser was killed while it read {name}: the machine may have too little memory"
        return f"{name} made its parser crash ({number.name if number else f'exit code {code}'}); it may be damaged"


_idle: list[Parser] = []
_lock = Lock()
_places = BoundedSemaphore(AT_ONCE)


@contextmanager
def _parser(limits: Limits) -> Iterator[Parser]:
    """A warm child, or a new one; it is kept for the next file if it survives."""
    with _places:
        with _lock:
            at = next((at for at, one in enumerate(_idle) if one.limits == limits and one.process.poll() is None), None)
            parser = None if at is None else _idle.pop(at)
        parser = parser or Parser(limits)
        try:
            yield parser
        except BaseException:
            parser.end()
            raise
        with _lock:
            _idle.append(parser)
            while len(_idle) > AT_ONCE:
                _idle.pop(0).end()


@atexit.register
def _end_all() -> None:
    with _lock:
        while _idle:
            _idle.pop().end()
