"""Which findings may be explained by another one, and are held back as long as that stands."""

from collections.abc import Iterator, Sequence

from core.drift.together import BOTH
from service.alerting.found import Found
from service.alerting.words import overlap

SOURCE = "source"
FROM_THE_SOURCE = ("record", "channel", "clock")
"""Causes that say nothing new while the source does not answer: the first part of their names."""


def holder(found: Found, others: Sequence[Found]) -> Found | None:
    """The finding that holds this one back, the earliest of them; None where nothing does."""
    return min(_holders(found, others), key=lambda other: (other.began_at, other.cause), default=None)


def _holders(found: Found, others: Sequence[Found]) -> Iterator[Found]:
    for other in others:
        if other.is_sure and (_explains(other, found) or _silences(other, found) or _tells_it(other, found)):
            yield other


def _explains(sensor: Found, found: Found) -> bool:
    """Whether a sensor that measures wrongly may be all there is to a drift: found with it, after it went wrong.

    One that went wrong later explains nothing of what was found before.
    """
    return (
        sensor.kind == "sensor"
        and found.kind in ("deterioration", "recovery", "model")
        and sensor.began_at <= found.raised_at
        and not set(sensor.channels).isdisjoint(found.channels)
    )


def _tells_it(other: Found, found: Found) -> bool:
    """Whether it was told before, by both directions together or by one of them; of one earthquake both go first."""
    if other.kind != found.kind or not overlap(other.cause, found.cause):
        return False
    return (other.raised_at, not other.cause.endswith(BOTH)) < (found.raised_at, not found.cause.endswith(BOTH))


def _silences(source: Found, found: Found) -> bool:
    """Whether data stopped because nothing at all comes from the source."""
    return source.cause == SOURCE and found.kind == "data" and found.cause.partition("/")[0] in FROM_THE_SOURCE
