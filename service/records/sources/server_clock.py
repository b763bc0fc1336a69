"""By how much is a server's clock ahead of ours, as its answers tell?"""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from email.utils import parsedate_to_datetime

import httpx


@dataclass(slots=True)
class ServerClock:
    """What the latest answer told."""

    clock: Callable[[], datetime]
    """Ours."""
    ahead: timedelta | None = None
    """None as long as no answer gave its time."""

    def hear(self, response: httpx.Response) -> None:
        """Take the time that an answer was made at; one that was kept by a proxy (`Age`) tells nothing."""
        written = response.headers.get("date")
        if written is None or "age" in response.headers:
            return
        try:
            self.ahead = parsedate_to_datetime(written) - self.clock()
        except (ValueError, TypeError):  # no date, or one without a zone
            return
