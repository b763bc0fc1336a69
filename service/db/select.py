"""Parts of queries: pages of lists, and periods."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, TypeVar

from sqlalchemy import BindParameter, Integer, Row, Select, bindparam
from sqlalchemy.orm import InstrumentedAttribute

from service.records.tables import Event

Question = Select[*tuple[Any, ...]]
Line = Row[*tuple[Any, ...]]
R = TypeVar("R")
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True, slots=True)
class Place:
    """The end of a page of a list; the next page starts after it."""

    time: datetime
    id: int

    def __str__(self) -> str:
        return f"{(self.time - EPOCH) // timedelta(microseconds=1)}_{self.id}"

    @classmethod
    def read(cls, cursor: str) -> "Place":
        """The place that a cursor (from `str`) encodes."""
        microseconds, identity = cursor.split("_")
        return cls(EPOCH + timedelta(microseconds=int(microseconds)), int(identity))


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Events that start at `after` or later and before `before`."""

    after: datetime | None = None
    before: datetime | None = None

    def limit(self, query: Question) -> Question:
        """The query limited to these events."""
        if self.after is not None:
            query = query.where(Event.start >= self.after)
        return query if self.before is None else query.where(Event.start < self.before)


def numbers(name: str) -> BindParameter[int]:
    """Numbers of rows that a statement gets when it runs, for `column.in_`; so it is made only once."""
    return bindparam(name, type_=Integer(), expanding=True)


def latest(query: Select[R], number: InstrumentedAttribute[int], before: int | None, limit: int) -> Select[R]:
    """A page of rows in descending order of their number; `before` is the last number of the previous page."""
    if before is not None:
        query = query.where(number < before)
    return query.order_by(number.desc()).limit(limit)
