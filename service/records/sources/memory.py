"""What a source remembers of its files between two looks."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

BATCH = 500
"""Files that are asked for together."""
One = TypeVar("One")


@dataclass(frozen=True, slots=True)
class Known:
    """A file of a source, as far as it was taken."""

    address: str
    """A path or an address."""
    mark: str | None = None
    """Tells the version that was taken; None until one was."""
    attempts: int = 0
    """Looks at which it came, but not whole as it seems."""
    version: str | None = None
    """What the server must still have for the beginning to be of use; None if no beginning is kept."""
    beginning: bytes | None = field(default=None, repr=False)
    """Of a body that broke off."""


class Memory(Protocol):
    """What is known of a source's files; there may be hundreds of thousands."""

    def known(self, addresses: Sequence[str]) -> Mapping[str, Known]:
        """By address, those that anything is known of; without their beginnings."""
        ...

    def beginning(self, address: str) -> bytes:
        """Of a body that broke off."""
        ...


def in_batches(files: Sequence[One]) -> Iterator[Sequence[One]]:
    """The files, so many at a time as may be asked for together."""
    for first in range(0, len(files), BATCH):
        yield files[first : first + BATCH]
