"""Which times of which channels a server may still come to have."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from service.records.sources.miniseed import Piece

TOGETHER = timedelta(seconds=60)
"""Gaps nearer to each other than this are asked for as one, and channels that lag by less are waited for together."""
FURTHEST_BACK = timedelta(hours=1)
"""A gap that gets longer and longer, of a dead channel, is asked for over no more than this, or the lateness."""


@dataclass(frozen=True, slots=True)
class Gap:
    """A time of which channels are missing."""

    start: datetime
    end: datetime
    channels: tuple[str, ...]


def gaps(pieces: Sequence[Piece], asked: Gap) -> Iterator[Gap]:
    """What is still missing of what was asked for."""
    for channel in asked.channels:
        covered = asked.start
        for piece in sorted((p for p in pieces if p.channel == channel), key=lambda piece: piece.start):
            if piece.start - covered > piece.interval:
                yield Gap(covered, min(piece.start, asked.end), (channel,))
            covered = max(covered, piece.end)
        if covered < asked.end:
            yield Gap(covered, asked.end, (channel,))


def reached(pieces: Sequence[Piece], start: datetime, silent: datetime) -> datetime:
    """From when to ask next, after a question that began at `start` and went up to now.

    The newest sample of the channel that lags most, of those that lag little; `silent` where there is nothing.
    """
    ends: dict[str, datetime] = {}
    for piece in pieces:
        ends[piece.channel] = max(piece.end, ends.get(piece.channel, piece.end))
    newest = max(ends.values(), default=silent)
    return max(start, min((end for end in ends.values() if newest - end < TOGETHER), default=silent))


def still_open(found: Iterable[Gap], now: datetime, late: timedelta) -> tuple[Gap, ...]:
    """The gaps that may still be filled; near ones of a channel are one, and equal ones of channels too."""
    longest = max(late, FURTHEST_BACK)
    of_channels: dict[str, list[tuple[datetime, datetime]]] = defaultdict(list)
    for gap in sorted(found, key=lambda gap: gap.start):
        for channel in gap.channels:
            had = of_channels[channel]
            if had and gap.start - had[-1][1] < TOGETHER:
                had[-1] = (had[-1][0], max(had[-1][1], gap.end))
            else:
                had.append((gap.start, gap.end))
    together: dict[tuple[datetime, datetime], list[str]] = defaultdict(list)
    for channel, times in of_channels.items():
        for start, end in times:
            if end + late > now:
                together[max(start, end - longest), end].append(channel)
    return tuple(Gap(start, end, tuple(channels)) for (start, end), channels in sorted(together.items()))


def written(found: Iterable[Gap]) -> list[dict[str, Any]]:
    """As JSON, for a cursor."""
    return [{"from": gap.start.isoformat(), "to": gap.end.isoformat(), "channels": [*gap.channels]} for gap in found]


def noted(rows: Iterable[Mapping[str, Any]]) -> tuple[Gap, ...]:
    """From a cursor."""
    times = datetime.fromisoformat
    return tuple(Gap(times(row["from"]), times(row["to"]), tuple(row["channels"])) for row in rows)
