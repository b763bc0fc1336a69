"""A source of files: its interface, the files it returns, and its memory of files fetched before."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Protocol, TypeVar

from service.addresses import without_credentials

Cursor = Mapping[str, Any]
"""Position in a source, as the source's own JSON; its size does not grow with the data."""
BATCH = 500
"""Files looked up together."""
One = TypeVar("One")


class SourceError(Exception):
    """A source that could not be read; the message gives the cause and the remedy, and repeats no secret."""

    def __init__(self, message: str) -> None:
        super().__init__(without_credentials(message))


class TooLargeError(SourceError):
    """An answer or a file of more bytes than are accepted."""

    def __init__(self, origin: str, size: int | None, limit: int) -> None:
        amount = f"more than {limit}" if size is None else f"{size}"
        super().__init__(
            f"{origin} has {amount} bytes, {limit} are accepted; use smaller files or a larger max_answer_bytes"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrival:
    """A file, or an answer of a server."""

    name: str
    origin: str
    """A path or an address."""
    data: bytes | None
    """None where it was not fetched."""
    refusal: str | None = None
    """Reason why it was not fetched."""


@dataclass(frozen=True, slots=True)
class Known:
    """A file of a source, as far as it was fetched."""

    address: str
    """A path or an address."""
    mark: str | None = None
    """Version that was fetched; None until one was."""
    attempts: int = 0
    """Times that it came, but seems to be incomplete."""
    version: str | None = None
    """Version that the kept beginning belongs to; None if no beginning is kept."""
    beginning: bytes | None = field(default=None, repr=False)
    """Beginning of a body that broke off."""


@dataclass(frozen=True, slots=True)
class Step:
    """The result of one step of reading a source, and where to continue once it is stored."""

    arrivals: tuple[Arrival, ...]
    cursor: Cursor
    files: tuple[Known, ...] = ()
    """New state of files, to be remembered."""


class Source(Protocol):
    """A building's monitoring server."""

    def steps(self, cursor: Cursor, now: datetime) -> Iterator[Step]:
        """New files since the cursor, step by step; a step's cursor leaves out all that the step returned.

        Raises:
            SourceError: after as many attempts as are set.
        """
        ...


class Memory(Protocol):
    """Memory of a source's files, of which there may be hundreds of thousands."""

    def known(self, addresses: Sequence[str]) -> Mapping[str, Known]:
        """The known files by address, without their beginnings."""
        ...

    def beginning(self, address: str) -> bytes:
        """The beginning of a body that broke off."""
        ...


def in_batches(files: Sequence[One]) -> Iterator[Sequence[One]]:
    """The files in batches that may be looked up together."""
    for first in range(0, len(files), BATCH):
        yield files[first : first + BATCH]
