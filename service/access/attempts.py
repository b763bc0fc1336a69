"""How often somebody may try to log in."""

import time
from collections import OrderedDict, deque
from collections.abc import Callable

ATTEMPTS = 10
"""Refused attempts that an address has in a WINDOW."""
WINDOW = 60.0
"""s."""
ADDRESSES = 10_000
"""That are remembered; beyond, the one that tried longest ago is forgotten."""


class Attempts:
    """Refused attempts of the last WINDOW, by address."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._refused: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, address: str) -> float:
        """s after which the address may try again, 0 if it may now."""
        times = self._refused.get(address)
        if times is None:
            return 0.0
        while times and times[0] < self._clock() - WINDOW:
            times.popleft()
        return times[0] + WINDOW - self._clock() if len(times) >= ATTEMPTS else 0.0

    def refuse(self, address: str) -> None:
        """One more attempt was refused."""
        self._refused.setdefault(address, deque(maxlen=ATTEMPTS)).append(self._clock())
        self._refused.move_to_end(address)
        while len(self._refused) > ADDRESSES:
            self._refused.popitem(last=False)
