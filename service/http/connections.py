"""Connections that keep nobody waiting: a time limit for every wait for the other side, and a limit of their number.

uvicorn closes connections that are idle after an answer, and no others: a head that never ends, a body that never
comes and an answer that is never read each hold a connection, with its open file, for good.
"""

import asyncio
import logging
import resource
from collections import OrderedDict
from dataclasses import dataclass, field

import h11
from uvicorn.config import Config
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.server import ServerState

log = logging.getLogger(__name__)

RESERVED = 192
"""Open files that are left for the database, the program itself, and connections that come at the same moment."""
FULL = (
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Type: text/plain\r\nRetry-After: 5\r\nConnection: close\r\n"
    b"Content-Length: 26\r\n\r\nAll connections are taken.\n"
)
LINGER = 2**20
"""Bytes of an unwanted body that are read and dropped, so that the client gets to see the answer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Patience:
    """s that a connection may take."""

    head: float = 10.0
    """To its first request, and from the first byte of a request's head to the last."""
    body: float = 30.0
    """From a request's head to the end of its body."""
    answer: float = 60.0
    """Without taking a byte of an answer that waits to be sent."""
    next: float = 15.0
    """To the first byte of the next request."""
    linger: float = 2.0
    """To the end of a body that nobody wants."""


@dataclass(slots=True)
class Crowd:
    """The connections that are open."""

    most: int
    count: int = 0
    waiting: "OrderedDict[Connection, None]" = field(default_factory=OrderedDict)
    """Those of which no request is being answered, the one that has waited longest first."""

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
    """As many as wanted, and as the limit of open files allows."""
    files, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return wanted if files == resource.RLIM_INFINITY else max(8, min(wanted, files - RESERVED))


class Connection(H11Protocol):
    """A connection of uvicorn's, with an end to every wait."""

    def __init__(
        self,
        config: Config,
        server_state: ServerState,
        app_state: dict[str, object],
        _loop: asyncio.AbstractEventLoop | None = None,
        *,
        crowd: Crowd,
        patience: Patience,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self._crowd, self._patience = crowd, patience
        self._timer: asyncio.TimerHandle | None = None
        self._write_timer: asyncio.TimerHandle | None = None
        self._waits_for: str | None = None
        self._dropped = 0
        self._is_counted = False

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Let it in if there is room."""
        if not self._crowd.has_room():
            transport.write(FULL)
            transport.close()
            self.transport = transport
            return
        self._crowd.count += 1
        self._is_counted = True
        super().connection_made(transport)
        self._wait_for("head")

    def connection_lost(self, exc: Exception | None) -> None:
        """Make room."""
        if not self._is_counted:
            return
        self._crowd.count -= 1
        self._wait_for(None)
        self._unset(self._write_timer)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read on, and wait for what is missing."""
        if not self._is_counted:
            return
        if self._waits_for == "linger":
            self._dropped += len(data)
            if self._dropped > LINGER:
                self.drop()
                return
        super().data_received(data)
        self._look()

    def on_response_complete(self) -> None:
        """Wait for the next request, or for the end of a body that was not read."""
        super().on_response_complete()
        self._look()

    def pause_writing(self) -> None:
        """The other side takes nothing: not for ever."""
        super().pause_writing()
        self._unset(self._write_timer)
        self._write_timer = self.loop.call_later(self._patience.answer, self.drop)

    def resume_writing(self) -> None:
        """It does again."""
        self._unset(self._write_timer)
        super().resume_writing()

    def drop(self) -> None:
        """Close the connection at once."""
        if self.transport is not None:
            self.transport.abort()

    def _look(self) -> None:
        """See what there is to wait for."""
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
        """Begin to wait, unless we do already; nothing that comes meanwhile makes the wait any longer."""
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
