"""The API as it is served: in this process, or in one of its own that is watched over."""

import logging
import signal
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.context import SpawnProcess
from multiprocessing.synchronize import Event
from threading import Event as Signal, Thread
from time import monotonic

from service import logs
from service.access.roles import Caller
from service.settings import Settings

log = logging.getLogger(__name__)

LOOK_UP = 0.5
"""s."""
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 60.0
"""s, half of the first and the longest before the API's process is started again."""
END = 15.0
"""s that the API's process has to end."""


def address(settings: Settings, door: socket.socket) -> str:
    """Where people on this machine reach the pages."""
    host, port = door.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


@contextmanager
def listening(settings: Settings) -> Iterator[socket.socket]:
    """The socket that the settings name, open before anything is served there."""
    from service.http.server import BACKLOG

    family = socket.AF_INET6 if ":" in settings.host else socket.AF_INET
    with socket.create_server((settings.host, settings.port), family=family, backlog=BACKLOG) as door:
        yield door


def api(
    settings: Settings,
    stop: Signal,
    door: socket.socket,
    visitor: Caller | None = None,
    answering: Callable[[], None] = lambda: None,
) -> None:
    """Serve the API, in this process, until it is asked to end.

    Args:
        settings: in force.
        stop: set when it is to end; it is set when the server ends by itself.
        door: where it serves.
        visitor: see service.app.create.
        answering: called once requests are answered.
    """
    if stop.is_set():
        return
    from service.app import create
    from service.http.server import server

    running = server(create(settings, visitor), answering=answering)

    def end_with_the_others() -> None:
        stop.wait()
        running.should_exit = True

    Thread(target=end_with_the_others, daemon=True, name="end of the API").start()
    log.info("serving at %s", address(settings, door))
    running.run(sockets=[door])
    stop.set()


def api_apart(
    settings: Settings,
    stop: Signal,
    door: socket.socket,
    visitor: Caller | None = None,
    answering: Callable[[], None] = lambda: None,
) -> None:
    """Serve the API from a process of its own until it is asked to end: what befalls it befalls nobody else.

    It has open files, memory and a lock of its own. One that ends by itself is started again, ever later; connections
    that come meanwhile wait at the socket, which is ours.

    Args:
        settings: in force.
        stop: set when it is to end.
        door: where it serves.
        visitor: see service.app.create.
        answering: called once, in this process, as soon as requests are answered.
    """
    pause, answers, is_told = FIRST_PAUSE, get_context("spawn").Event(), False
    while not stop.is_set():
        begun = monotonic()
        process = _served_apart(settings, door, visitor, answers)
        try:
            while process.is_alive() and not stop.wait(LOOK_UP):
                if answers.is_set() and not is_told:
                    is_told = True
                    answering()
        finally:
            _ended(process, wanted=stop.is_set())
        if stop.is_set():
            return
        pause = FIRST_PAUSE if monotonic() - begun > LONGEST_PAUSE else min(2 * pause, LONGEST_PAUSE)
        log.error("the API ended by itself, with code %s; it is started again in %g s", process.exitcode, pause)
        stop.wait(pause)


def _served_apart(settings: Settings, door: socket.socket, visitor: Caller | None, answers: Event) -> SpawnProcess:
    level = logging.getLogger().level
    process = get_context("spawn").Process(target=_serve, args=(settings, door, visitor, answers, level), name="API")
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # inherited: Ctrl-C at the terminal is for us to pass on
    try:
        process.start()
    finally:
        signal.signal(signal.SIGINT, before)
    return process


def _ended(process: SpawnProcess, *, wanted: bool) -> None:
    """Ask the process to end, and see to it."""
    if wanted:
        process.terminate()
    process.join(END)
    if process.is_alive():
        log.warning("the API did not end within %g s and is killed", END)
        process.kill()
        process.join()


def _serve(settings: Settings, door: socket.socket, visitor: Caller | None, answers: Event, level: int) -> None:
    """The process of the API: it ends by SIGTERM, or when its parent is gone."""
    import service.app  # noqa: F401  it takes seconds, in which SIGTERM ends us at once

    stop, parent = Signal(), parent_process()
    assert parent is not None
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    logs.begin(level)

    def end_with_the_parent() -> None:
        parent.join()
        stop.set()

    Thread(target=end_with_the_parent, daemon=True, name="end of the parent").start()
    api(settings, stop, door, visitor, answers.set)
