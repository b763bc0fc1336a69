"""The HTTP server: uvicorn with our connections, on a socket that was opened before."""

import contextlib
import logging
import socket
import time
from collections.abc import Callable, Iterator
from functools import partial
from threading import Event as Signal

import uvicorn
from fastapi import FastAPI

from service.http.connections import Connection, Crowd, Patience, most_connections
from service.settings import Settings

GRACE = 5
"""s that answers which are under way have when the server ends."""
BACKLOG = 64
"""Connections that wait at the socket until the server takes them, and that it takes before it looks at any."""
HEAD = 32 * 2**10
"""Bytes of a request's head."""


class Server(uvicorn.Server):
    """uvicorn's, which leaves the signals to us and says when it ends."""

    def __init__(self, config: uvicorn.Config, ending: Signal, answering: Callable[[], None]) -> None:
        super().__init__(config)
        self._ending = ending
        self._answering = answering

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Whoever runs it sets `should_exit`."""
        yield

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin, and say so once requests are answered."""
        await super().startup(sockets)
        if not self.should_exit:
            self._answering()

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """End, streams first."""
        self._ending.set()
        await super().shutdown(sockets)


def server(app: FastAPI, patience: Patience | None = None, answering: Callable[[], None] = lambda: None) -> Server:
    """A server of our application; `run(sockets=[...])` serves until `should_exit` is set.

    Args:
        app: ours.
        patience: how long connections are waited for.
        answering: called once requests are answered.
    """
    settings: Settings = app.state.settings
    throttle()
    patience = patience or Patience()
    made = partial(Connection, crowd=Crowd(most_connections(settings.max_connections)), patience=patience)
    config = uvicorn.Config(
        app,
        http=made,  # type: ignore[arg-type]  # a class that is called, or what is called as one
        ws="none",
        log_level="warning",
        log_config=None,
        access_log=False,  # its lines would hold the tokens of login links
        server_header=False,
        backlog=BACKLOG,
        proxy_headers=bool(settings.trusted_proxies),  # else who asks is told by the connection alone
        forwarded_allow_ips=list(settings.trusted_proxies),
        timeout_keep_alive=int(patience.next),
        timeout_graceful_shutdown=GRACE,
        h11_max_incomplete_event_size=HEAD,
    )
    return Server(config, app.state.ending, answering)


WINDOW = 60.0
"""s."""
MOST = 5
"""Lines from one place in the program in a WINDOW; the first of the next one says how many were left out."""
LOGGERS = ("service.http.connections", "uvicorn.error", "asyncio")


class Throttle(logging.Filter):
    """Lets the first lines of each kind in a window pass."""

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
            record.msg = f"{record.msg} ({count - MOST} more such lines were left out)"
        return True


def throttle() -> None:
    """Throttle the loggers that write whatever the network brings about; those that are throttled stay so."""
    for name in LOGGERS:
        logger = logging.getLogger(name)
        if not any(isinstance(one, Throttle) for one in logger.filters):
            logger.addFilter(Throttle())
