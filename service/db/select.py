"""Parts of queries: pages of lists, and spans of events."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, TypeVar

from sqlalchemy import Row, Select
from sqlalchemy.orm import InstrumentedAttribute

from service.records.tables import Event

Question = Select[*tuple[Any, ...]]
Line = Row[*tuple[Any, ...]]
R = TypeVar("R")
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a page of a list ends: the next one starts just after it."""

    time: datetime
    id: int

    def __str__(self) -> str:
        return f"{(self.time - EPOCH) // timedelta(microseconds=1)}_{self.id}"

    @classmethod
    def read(cls, cursor: str) -> "Place":
        """The place that a cursor, as written by `str`, stands for."""
        microseconds, identity = cursor.split("_")
        return cls(EPOCH + timedelta(microseconds=int(microseconds)), int(identity))


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Which events: those that start at `after` or later and before `before`."""

    after: datetime | None = None
    before: datetime | None = None

    def limit(self, question: Question) -> Question:
        """The question about these events only."""
        if self.after is not None:
            question = question.where(Event.start >= self.after)
        return question if self.before is None else question.where(Event.start < self.before)


def latest(query: Select[R], number: InstrumentedAttribute[int], before: int | None, limit: int) -> Select[R]:
    """A page of rows by falling number; `before` is the number at which the page before ended."""
    if before is not None:
        query = query.where(number < before)
    return query.order_by(number.desc()).limit(limit)
