"""The API server, in this process or in a supervised process of its own."""

import gc
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
from types import ModuleType

from service import logs, tracing
from service.access.roles import Caller
from service.process import GARBAGE
from service.settings import Settings

log = logging.getLogger(__name__)

LOOK_UP = 0.5
"""s between two looks at the process."""
FIRST_PAUSE, LONGEST_PAUSE = 0.5, 60.0
"""s, half of the first and the longest pause before the API's process is restarted."""
END = 15.0
"""s that the API's process has to end before it is killed."""


def address(settings: Settings, door: socket.socket) -> str:
    """Address of the pages on this machine."""
    host, port = door.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


@contextmanager
def listening(settings: Settings) -> Iterator[socket.socket]:
    """The socket at the host and port of the settings, opened before the server starts."""
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
    """Serve the API in this process until `stop` is set.

    Args:
        settings: the service's settings.
        stop: ends the server when set; set when the server ends by itself.
        door: the listening socket.
        visitor: see service.app.create.
        answering: called once the server answers requests.
    """
    if stop.is_set():
        return
    from service.http.server import server

    application = loaded().create(settings, visitor)
    gc.freeze()  # as its modules: a search through all of it takes 0.3 s, every few pages that read thousands of rows
    running = server(application, answering=answering)

    def end_with_other_parts() -> None:
        stop.wait()
        running.should_exit = True

    Thread(target=end_with_other_parts, daemon=True, name="end of the API").start()
    log.info("serving at %s", address(settings, door))
    running.run(sockets=[door])
    stop.set()


def api_in_own_process(
    settings: Settings,
    stop: Signal,
    door: socket.socket,
    visitor: Caller | None = None,
    answering: Callable[[], None] = lambda: None,
) -> None:
    """Serve the API from a process of its own until `stop` is set, so that its failure affects no other part.

    The process has its own open files, memory and interpreter lock. If it ends by itself it is restarted after growing
    pauses; new connections wait meanwhile at the socket, which this process owns.

    Args:
        settings: the service's settings.
        stop: ends the server when set.
        door: the listening socket.
        visitor: see service.app.create.
        answering: called once, in this process, as soon as the server answers requests.
    """
    pause, answers, is_reported = FIRST_PAUSE, get_context("spawn").Event(), False
    while not stop.is_set():
        start = monotonic()
        process = _start_process(settings, door, visitor, answers)
        try:
            while process.is_alive() and not stop.wait(LOOK_UP):
                if answers.is_set() and not is_reported:
                    is_reported = True
                    answering()
        finally:
            _end(process, terminate=stop.is_set())
        if stop.is_set():
            return
        pause = FIRST_PAUSE if monotonic() - start > LONGEST_PAUSE else min(2 * pause, LONGEST_PAUSE)
        log.error("the API ended by itself with exit code %s; it restarts in %g s", process.exitcode, pause)
        stop.wait(pause)


def _start_process(settings: Settings, door: socket.socket, visitor: Caller | None, answers: Event) -> SpawnProcess:
    level = logging.getLogger().level
    process = get_context("spawn").Process(target=_serve, args=(settings, door, visitor, answers, level), name="API")
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)  # inherited by the child: this process passes Ctrl-C on
    try:
        process.start()
    finally:
        signal.signal(signal.SIGINT, before)
    return process


def _end(process: SpawnProcess, *, terminate: bool) -> None:
    """Wait for the process to end, after SIGTERM if it is to end, and kill it if it does not."""
    if terminate:
        process.terminate()
    process.join(END)
    if process.is_alive():
        log.warning("the API did not end within %g s and is killed", END)
        process.kill()
        process.join()


def _serve(settings: Settings, door: socket.socket, visitor: Caller | None, answers: Event, level: int) -> None:
    """The main function of the API's process; it ends on SIGTERM, or with its parent."""
    loaded()  # takes seconds, during which SIGTERM ends the process at once
    stop, parent = Signal(), parent_process()
    assert parent is not None
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    logs.begin(level, settings.log_format)
    tracing.begin(settings.traces.endpoint, settings.traces.share, "api")

    def end_with_parent() -> None:
        parent.join()
        stop.set()

    Thread(target=end_with_parent, daemon=True, name="end of the parent").start()
    api(settings, stop, door, visitor, answers.set)


def loaded() -> ModuleType:
    """The module of the application, imported without garbage collection, which took almost half of the time."""
    gc.disable()
    try:
        import service.app
    finally:
        gc.freeze()  # modules live as long as the process
        gc.set_threshold(*GARBAGE)
        gc.enable()
    return service.app
