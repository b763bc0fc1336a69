"""Connections with a time limit for every wait, and a limit of their number.

uvicorn closes only connections that are idle after a response. An endless head, a missing body or a response that is
never read would each occupy a connection, with its open file, forever.
"""

import asyncio
import logging
import resource
import socket
from collections import OrderedDict
from dataclasses import dataclass, field

import h11
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

log = logging.getLogger(__name__)

RESERVED = 192
"""Open files reserved for the database, the program itself, and simultaneous new connections."""
FULL = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nRetry-After: 5\r\nConnection: close\r\n"
    b"Content-Length: 26\r\n\r\nAll connections are in use\n"
)
LINGER = 2**20
"""Bytes of an unwanted body that are read and discarded, so that the client can read the response."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimeLimits:
    """Time limits of a connection, s."""

    head: float = 10.0
    """Until its first request, and from the first to the last byte of a request's head."""
    body: float = 30.0
    """From a request's head to the end of its body."""
    answer: float = 60.0
    """Without the client accepting a byte of a waiting response."""
    next: float = 15.0
    """To the first byte of the next request."""
    linger: float = 2.0
    """Until the end of an unwanted body."""


@dataclass(slots=True)
class OpenConnections:
    """All open connections."""

    most: int
    count: int = 0
    waiting: "OrderedDict[Connection, None]" = field(default_factory=OrderedDict)
    """Connections whose request is not being answered, the one that has waited longest first."""

    def has_room(self) -> bool:
        """True if there is room for another connection; if necessary the one that has waited longest is closed."""
        if self.count < self.most:
            return True
        log.warning("%d connections are open, as many as may be: those without a request are closed", self.count)
        if not self.waiting:
            return False
        self.waiting.popitem(last=False)[0].drop()
        return True


def most_connections(wanted: int) -> int:
    """The given number, as far as the limit of open files allows."""
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return wanted if files == resource.RLIM_INFINITY else max(8, min(wanted, files - RESERVED))


class Connection(H11Protocol):
    """A connection of uvicorn with a limit for every wait."""

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, object],
        _loop: asyncio.AbstractEventLoop | None = None,
        *,
        open_connections: OpenConnections,
        time_limits: TimeLimits,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self._crowd, self._patience = open_connections, time_limits
        self._timer: asyncio.TimerHandle | None = None
        self._write_timer: asyncio.TimerHandle | None = None
        self._waits_for: str | None = None
        self._dropped = 0
        self._is_counted = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Accept the connection if there is room."""
        if not self._crowd.has_room():
            transport.write(FULL)
            transport.close()
            self.transport = transport
            return
        self._crowd.count += 1
        self._is_counted = True
        # asyncio does so itself only where the listening socket was made with IPPROTO_TCP; create_server's was not.
        # Without, a body waits until the client acknowledges the head: 40 ms on most systems.
        transport.get_extra_info("socket").setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        super().connection_made(transport)
        self._wait_for("head")

    def connection_lost(self, exc: Exception | None) -> None:
        """Release its place."""
        if not self._is_counted:
            return
        self._crowd.count -= 1
        self._wait_for(None)
        self._unset(self._write_timer)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Continue reading, and wait for the missing rest."""
        if not self._is_counted:
            return
        if self._waits_for == "linger":
            self._dropped += len(data)
            if self._dropped > LINGER:
                self.drop()
                return
        super().data_received(data)
        self._start_wait()

    def on_response_complete(self) -> None:
        """Wait for the next request, or for the end of a body that was not read."""
        super().on_response_complete()
        self._start_wait()

    def pause_writing(self) -> None:
        """Limit the wait for a client that does not read."""
        super().pause_writing()
        self._unset(self._write_timer)
        self._write_timer = self.loop.call_later(self._patience.answer, self.drop)

    def resume_writing(self) -> None:
        """End that limit."""
        self._unset(self._write_timer)
        super().resume_writing()

    def drop(self) -> None:
        """Close the connection at once."""
        if self.transport is not None:
            self.transport.abort()

    def _start_wait(self) -> None:
        """Start the wait that applies now."""
        if self.transport.is_closing():
            self._wait_for(None)
        elif self.cycle is None or self.cycle.response_complete:
            if self.conn.their_state is h11.SEND_BODY:
                self._wait_for("linger")
            elif self.cycle is None or self.conn.trailing_data[0]:
                self._wait_for("head")
            else:
                self._wait_for("next")
        else:
            self._wait_for("body" if self.conn.their_state is h11.SEND_BODY else None)

    def _wait_for(self, what: str | None) -> None:
        """Start a wait, unless it runs already; data that arrives meanwhile does not extend it."""
        if what == self._waits_for:
            return
        self._waits_for = what
        self._unset(self._timer)
        self._timer = None
        self._crowd.waiting.pop(self, None)
        if what in ("head", "next"):
            self._crowd.waiting[self] = None
        if what == "linger":
            self._dropped = 0
        if what is not None:
            self._timer = self.loop.call_later(getattr(self._patience, what), self.drop)

    @staticmethod
    def _unset(timer: asyncio.TimerHandle | None) -> None:
        if timer is not None:
            timer.cancel()
