"""Server-sent events about what is under way: what it is now, then whenever it changes, until it is over."""

from collections.abc import AsyncIterator, Callable
from typing import TypeVar

import anyio
from anyio import to_thread
from fastapi import Request

from service.access import auth
from service.errors import ServiceError

T = TypeVar("T")

LOOK = 0.3
"""s between two looks at what is followed."""
CHECK = 2.0
"""s between two looks whether who follows it still may: a key may be revoked meanwhile."""


async def followed(request: Request, read: Callable[[], T], is_over: Callable[[T], bool]) -> AsyncIterator[T]:
    """Each new answer of `read`, which is called in a thread.

    Ends when it is over, when the service stops, when the key that came with the request is no longer in force, and
    after the setting `progress_patience` without news; browsers then ask again by themselves. Comments that keep
    proxies from closing the connection are FastAPI's own.
    """
    state, seen = request.app.state, None
    told = checked = anyio.current_time()
    while anyio.current_time() - told < state.settings.progress_patience and not state.is_ending():
        found = await to_thread.run_sync(read)
        if found != seen:
            seen, told = found, anyio.current_time()
            yield found
        if is_over(found):
            return
        await anyio.sleep(LOOK)
        if anyio.current_time() - checked > CHECK:
            checked = anyio.current_time()
            if not await _may_follow(request):
                return


async def _may_follow(request: Request) -> bool:
    try:
        await auth.viewer(request)
    except ServiceError:
        return False
    return True
