"""The HTTP server: uvicorn with our connections, on a socket that was opened before."""

import contextlib
import socket
from collections.abc import Callable, Iterator
from functools import partial
from threading import Event as Signal

import uvicorn
from fastapi import FastAPI

from service.http.connections import Connection, Crowd, Patience, most_connections
from service.http.throttle import throttle
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
