"""The order in which a queue was served: whether a more urgent one waited meanwhile."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

MOMENT = 1.0
"""s after which all can see what was stored: a transaction has its time before it is committed."""


@dataclass(frozen=True, slots=True)
class Order:
    """The order in which a queue was served."""

    places: int
    """Largest number of more urgent ones that waited while one was served."""
    preferred: int
    """Number of pairs of which the more urgent one did not come before the other, and was served first."""


def order(
    rank: Sequence[float], came: Sequence[datetime], chosen: Sequence[datetime], ended: Sequence[datetime]
) -> Order:
    """The order in which a queue was served.

    Args:
        rank: of each; the most urgent has the smallest.
        came: when each was put into the queue.
        chosen: when each was taken from it, or a time before.
        ended: when each was taken from it, or a time after.
    """
    ranks = np.asarray(rank)
    begins, choices, ends = (np.array([one.timestamp() for one in times]) for times in (came, chosen, ended))
    places, preferred = 0, 0
    for own, begin, choice, end in zip(ranks, begins, choices, ends, strict=True):
        urgent = ranks < own
        places = max(places, int((urgent & (begins + MOMENT <= choice) & (ends > end)).sum()))
        preferred += int((urgent & (begins >= begin) & (ends < end)).sum())
    return Order(places, preferred)
