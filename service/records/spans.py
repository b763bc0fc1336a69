"""When a piece of a channel begins and ends."""

from datetime import datetime, timedelta
from math import ceil, floor

from service.formats import Trace

ROUNDING = 0.01
"""Samples: times are rounded to microseconds, and a sample at the very border must not get lost by it."""


def span(trace: Trace) -> tuple[datetime, datetime]:
    """Times of the first sample and of the last."""
    return trace.start, trace.start + timedelta(seconds=(trace.numbers.size - 1) / trace.rate)


def cut(trace: Trace, start: datetime, end: datetime) -> Trace | None:
    """The samples from `start` to `end`, both included; None if there are none."""
    first = max(0, ceil((start - trace.start).total_seconds() * trace.rate - ROUNDING))
    last = min(trace.numbers.size - 1, floor((end - trace.start).total_seconds() * trace.rate + ROUNDING))
    if first > last:
        return None
    return Trace(
        channel=trace.channel,
        start=trace.start + timedelta(seconds=first / trace.rate),
        rate=trace.rate,
        numbers=trace.numbers[first : last + 1],
        gain=trace.gain,
        quantity=trace.quantity,
    )
