"""Server-sent events on the progress of something: its state now, then every change until it ends."""

from collections.abc import AsyncIterator, Callable
from typing import TypeVar

import anyio
from anyio import to_thread
from fastapi import Request

T = TypeVar("T")

LOOK = 0.3
"""s between two reads of the state."""


async def followed(request: Request, read: Callable[[], T], is_over: Callable[[T], bool]) -> AsyncIterator[T]:
    """Each new result of `read`, which is called in a thread.

    It ends when `is_over` is true, and after the setting `progress_timeout` without news; browsers then reconnect.
    service.http.guard ends it with its caller's key or session and with the service. Comments that keep proxies from
    closing the connection are FastAPI's own.
    """
    timeout, seen = request.app.state.settings.progress_timeout, None
    reported_at = anyio.current_time()
    while anyio.current_time() - reported_at < timeout:
        state = await to_thread.run_sync(read)
        if state != seen:
            seen, reported_at = state, anyio.current_time()
            yield state
        if is_over(state):
            return
        await anyio.sleep(LOOK)
