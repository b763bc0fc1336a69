"""What a source hands over, and what every source is."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Protocol

from service.records.sources.memory import Known
from service.shown_addresses import without_credentials

Cursor = Mapping[str, Any]
"""How far a source was read: JSON, the source's own, and small however much was read."""


class SourceError(Exception):
    """A source that could not be read; the message says what was found and what would do, and repeats no secret."""

    def __init__(self, message: str) -> None:
        super().__init__(without_credentials(message))


class TooLargeError(SourceError):
    """An answer or a file of more bytes than are accepted."""

    def __init__(self, origin: str, size: int | None, limit: int) -> None:
        found = f"more than {limit}" if size is None else f"{size}"
        super().__init__(
            f"{origin} has {found} bytes, {limit} are accepted; smaller files, or a larger max_answer_bytes, would do"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrival:
    """A file or an answer, and how far the source has been read with it."""

    name: str
    origin: str
    """A path or an address."""
    data: bytes | None
    """None where it was not taken."""
    refusal: str | None = None
    """Why it was not taken."""


@dataclass(frozen=True, slots=True)
class Step:
    """What one step of reading a source brought, and where to go on once that is stored."""

    arrivals: tuple[Arrival, ...]
    cursor: Cursor
    files: tuple[Known, ...] = ()
    """What is known of files from now on."""


class Source(Protocol):
    """A building's monitoring server."""

    def steps(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """What is new since the cursor, step by step; nothing of a step is asked for again after its cursor.

        Raises:
            SourceError: after as many attempts as are set.
        """
        ...
