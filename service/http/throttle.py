"""A log that an attacker cannot fill."""

import logging
import time
from collections.abc import Callable

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
        """Whether the line is written."""
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
