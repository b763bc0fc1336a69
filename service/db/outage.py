"""What does a part of the service do while the database is away? It says so once, and tries again ever later."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from logging import Logger

from sqlalchemy.exc import OperationalError

LONGEST_PAUSE = 30.0
"""s between two attempts at a database that is away."""
MOST_DOUBLINGS = 30
"""Of a pause, which is the longest by then: a number stays one, however long the database is away."""


@dataclass(slots=True)
class Attempts:
    """One after the other at a database that may go away, and come back."""

    log: Logger
    failed: int = 0
    """How many in a row found no database."""

    @contextmanager
    def one(self) -> Iterator[None]:
        """One of them, which ends early where the database does not answer; any other error is raised."""
        try:
            yield
        except OperationalError as error:
            if not self.failed:
                self.log.warning("the database is out of reach, trying again: %s", error.orig)
            self.failed += 1
        else:
            if self.failed:
                self.log.warning("the database is back")
            self.failed = 0

    def pause(self, usual: float) -> float:
        """s before the next one: `usual` while the database answers, twice as long after each attempt that failed."""
        return min(usual * 2.0 ** min(self.failed, MOST_DOUBLINGS), LONGEST_PAUSE)
