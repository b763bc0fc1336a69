"""What is work doing, that somebody waits for?"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

Tell = Callable[[str, int, int], None]
"""Called with what is being done, how many are done, and of how many."""


def silent(doing: str, done: int, of: int) -> None:
    """Nobody waits."""


@dataclass(frozen=True, slots=True)
class Note:
    """A file into which a computation tells what it is doing, and another process looks."""

    path: Path

    def __call__(self, doing: str, done: int, of: int) -> None:
        """Tell; a Dask worker of another machine has no such folder, and no work fails over what is told of it."""
        new = self.path.with_suffix(".new")
        with suppress(OSError):
            new.write_text(doing, "utf-8")
            new.replace(self.path)

    def erase(self) -> None:
        """Nobody waits any more."""
        self.path.unlink(missing_ok=True)

    def read(self) -> str | None:
        """What was told last; None before the first."""
        try:
            return self.path.read_text("utf-8")
        except FileNotFoundError:
            return None
