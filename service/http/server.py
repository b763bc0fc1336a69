"""The HTTP server: uvicorn with limited connections, on a socket that is already open."""

import contextlib
import logging
import socket
import time
from collections.abc import Callable, Iterator
from functools import partial
from threading import Event as Signal

import uvicorn
from fastapi import FastAPI

from service.http.connections import Connection, OpenConnections, TimeLimits, most_connections
from service.settings import Settings

GRACE = 5
"""s that responses in progress have when the server ends."""
BACKLOG = 64
"""Connections that wait at the socket until the server accepts them."""
HEAD = 32 * 2**10
"""Bytes of a request's head."""


class Server(uvicorn.Server):
    """uvicorn's server, without signal handlers; it reports when it ends."""

    def __init__(self, config: uvicorn.Config, ending: Signal, answering: Callable[[], None]) -> None:
        super().__init__(config)
        self._ending = ending
        self._answering = answering

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """No signal handlers: the caller sets `should_exit`."""
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and report once requests are answered."""
        await super().startup(sockets)
        if not self.should_exit:
            self._answering()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End, streams first."""
        self._ending.set()
        await super().shutdown(sockets)


def server(app: FastAPI, time_limits: TimeLimits | None = None, answering: Callable[[], None] = lambda: None) -> Server:
    """A server of the application; `run(sockets=[...])` serves until `should_exit` is set.

    Args:
        app: the application.
        patience: time limits of connections.
        answering: called once requests are answered.
    """
    settings: Settings = app.state.settings
    throttle()
    time_limits = time_limits or TimeLimits()
    made = partial(
        Connection,
        open_connections=OpenConnections(most_connections(settings.max_connections)),
        time_limits=time_limits,
    )
    config = uvicorn.Config(
        app,
        http=made,  # type: ignore[arg-type]  # a class that is called, or what is called as one
        ws="none",
        log_level="warning",
        log_config=None,
        access_log=False,  # its lines would contain the tokens of login links
        server_header=False,
        backlog=BACKLOG,
        proxy_headers=bool(settings.trusted_proxies),  # otherwise only the closed connection shows the error
        forwarded_allow_ips=list(settings.trusted_proxies),
        timeout_keep_alive=int(time_limits.next),
        timeout_graceful_shutdown=GRACE,
        h11_max_incomplete_event_size=HEAD,
    )
    return Server(config, app.state.ending, answering)


WINDOW = 60.0
"""s in which lines are counted."""
MOST = 5
"""Lines from one place in the program per WINDOW; the first line of the next one gives the number omitted."""
LOGGERS = ("service.http.connections", "service.http.problems", "service.access.provider", "uvicorn.error", "asyncio")


class Throttle(logging.Filter):
    """Passes the first lines of each kind in a window."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._clock = clock
        self._windows: dict[tuple[object, ...], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        """True if the line is to be written."""
        error = record.exc_info[0] if record.exc_info else None
        kind = (record.name, record.lineno, record.msg if record.args else None, error)
        begun, count = self._windows.get(kind, (-float("inf"), 0))
        now = self._clock()
        if now - begun < WINDOW:
            self._windows[kind] = (begun, count + 1)
            return count < MOST
        self._windows[kind] = (now, 1)
        if count > MOST:
            record.msg = f"{record.msg} ({count - MOST} more such lines were omitted)"
        return True


def throttle() -> None:
    """Throttle the loggers whose lines the network can cause."""
    for name in LOGGERS:
        logger = logging.getLogger(name)
        if not any(isinstance(one, Throttle) for one in logger.filters):
            logger.addFilter(Throttle())
