"""Findings that another one may explain: they are on hold while that one is open."""

from collections.abc import Iterator, Sequence

from service.alerts.candidates import Found

SOURCE = "source"
FROM_THE_SOURCE = ("record", "channel", "clock")
"""Causes that say nothing new while the source does not answer: the first part of their names."""


def holder(found: Found, others: Sequence[Found]) -> Found | None:
    """The finding that may explain this one, the earliest of them; None where nothing does."""
    return min(_holders(found, others), key=lambda other: (other.began_at, other.cause), default=None)


def reason(by: Found) -> str:
    """Why what a finding may explain is on hold."""
    if by.cause == SOURCE:
        return f"On hold: {by.summary}, which explains it."
    return f"On hold: {by.summary}, and what is measured with that sensor may show nothing else."


def _holders(found: Found, others: Sequence[Found]) -> Iterator[Found]:
    for other in others:
        if other.is_sure and (_explains(other, found) or _silences(other, found)):
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


def _silences(source: Found, found: Found) -> bool:
    """Whether data stopped because nothing at all comes from the source."""
    return source.cause == SOURCE and found.kind == "data" and found.cause.partition("/")[0] in FROM_THE_SOURCE
