"""Which pieces belong to one earthquake: those whose times overlap, directly or through others."""

from collections.abc import Callable, Iterable
from datetime import datetime, timedelta
from typing import TypeVar

Piece = TypeVar("Piece")


def overlapping(
    pieces: Iterable[Piece], span: Callable[[Piece], tuple[datetime, datetime]], slack: timedelta = timedelta(0)
) -> tuple[tuple[Piece, ...], ...]:
    """The pieces in groups, earliest first, each group and each piece within it in order of time.

    Args:
        pieces: whatever has a beginning and an end.
        span: its first and last time, aware.
        slack: pieces this far apart still belong together, for loggers that cut their files.
    """
    groups: list[list[Piece]] = []
    latest: datetime | None = None
    for piece in sorted(pieces, key=span):
        start, end = span(piece)
        if latest is None or start > latest + slack:
            groups.append([])
            latest = end
        groups[-1].append(piece)
        latest = max(latest, end)
    return tuple(tuple(group) for group in groups)
