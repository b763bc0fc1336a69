"""Gaps in fetched waveforms that a server may still fill."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from service import parsing
from service.formats import FormatError
from service.formats.waveforms import Piece
from service.parsing import Limits, ParserDiedError, ParserFailedError

TOGETHER = timedelta(seconds=60)
"""Gaps closer than this are requested as one, and channels that lag by less share one next request."""
FURTHEST_BACK = timedelta(hours=1)
"""Longest request for the growing gap of a dead channel, unless the lateness is longer."""


@dataclass(frozen=True, slots=True)
class Gap:
    """A span of time in which channels are missing."""

    start: datetime
    end: datetime
    channels: tuple[str, ...]


def pieces(bodies: Iterable[bytes], limits: Limits) -> tuple[Piece, ...]:
    """The pieces in whole files of waveforms, leaving out files that exceed the parser's limits."""
    read: list[Piece] = []
    for body in bodies:
        try:
            read += parsing.covered("an answer", body, limits)
        except (FormatError, ParserDiedError, ParserFailedError):
            continue
    return tuple(read)


def gaps(pieces: Sequence[Piece], requested: Gap) -> Iterator[Gap]:
    """The parts of a request that are still missing."""
    for channel in requested.channels:
        covered = requested.start
        for piece in sorted((p for p in pieces if p.channel == channel), key=lambda piece: piece.start):
            if piece.start - covered > piece.interval:
                yield Gap(covered, min(piece.start, requested.end), (channel,))
            covered = max(covered, piece.end)
        if covered < requested.end:
            yield Gap(covered, requested.end, (channel,))


def reached(pieces: Sequence[Piece], start: datetime, silent: datetime) -> datetime:
    """Start of the next request, after one from `start` until now.

    It is the newest sample of the channel that lags most among those that lag little; `silent` where nothing came.
    """
    ends: dict[str, datetime] = {}
    for piece in pieces:
        ends[piece.channel] = max(piece.end, ends.get(piece.channel, piece.end))
    newest = max(ends.values(), default=silent)
    return max(start, min((end for end in ends.values() if newest - end < TOGETHER), default=silent))


def still_open(gaps: Iterable[Gap], now: datetime, late: timedelta) -> tuple[Gap, ...]:
    """The gaps that may still be filled, with near ones of a channel and equal ones of several channels joined."""
    longest = max(late, FURTHEST_BACK)
    of_channels: dict[str, list[tuple[datetime, datetime]]] = defaultdict(list)
    for gap in sorted(gaps, key=lambda gap: gap.start):
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


def written(gaps: Iterable[Gap]) -> list[dict[str, Any]]:
    """Gaps as JSON, for a cursor."""
    return [{"from": gap.start.isoformat(), "to": gap.end.isoformat(), "channels": [*gap.channels]} for gap in gaps]


def noted(rows: Iterable[Mapping[str, Any]]) -> tuple[Gap, ...]:
    """Gaps from a cursor."""
    times = datetime.fromisoformat
    return tuple(Gap(times(row["from"]), times(row["to"]), tuple(row["channels"])) for row in rows)
