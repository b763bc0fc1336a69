"""Parts of queries: pages of lists, and periods."""

import json
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any, TypeVar

from sqlalchemy import Boolean, ColumnElement, Dialect, Integer, Row, Select, Text, TypeDecorator, bindparam
from sqlalchemy.dialects.postgresql import ARRAY
from sqlalchemy.ext.compiler import compiles
from sqlalchemy.orm import InstrumentedAttribute, Session
from sqlalchemy.sql.compiler import SQLCompiler
from sqlalchemy.sql.functions import FunctionElement
from sqlalchemy.types import TypeEngine

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


def lines(session: Session, query: Question) -> Sequence[Line]:
    """All rows of a query for columns alone, read without the ORM, which takes twice as long for thousands of rows."""
    return session.connection().execute(query).all()


class among(FunctionElement[bool]):  # noqa: N801  used like a function, as those of SQLAlchemy
    """True where a number is among those that a statement gets under a name when it runs.

    `column.in_` has a parameter for each number, so that SQLAlchemy writes the statement anew each time, and the driver
    and PostgreSQL read it anew.

    Args:
        column: the number.
        name: of the parameter, a list.
    """

    name = "among"
    type = Boolean()
    inherit_cache = True

    def __init__(self, column: ColumnElement[Any] | InstrumentedAttribute[Any], name: str) -> None:
        super().__init__(column, bindparam(name, type_=_Numbers()))


class _Numbers(TypeDecorator[Collection[int]]):
    """Numbers as one parameter: an array, or JSON on SQLite."""

    impl = Text
    cache_ok = True

    def load_dialect_impl(self, dialect: Dialect) -> TypeEngine[Any]:
        return dialect.type_descriptor(ARRAY(Integer()) if dialect.name == "postgresql" else Text())

    def process_bind_param(self, value: Collection[int] | None, dialect: Dialect) -> object:
        numbers = list(value or ())
        return numbers if dialect.name == "postgresql" else json.dumps(numbers)


@compiles(among, "postgresql")
def _in_array(element: among, compiler: SQLCompiler, **options: Any) -> str:  # noqa: ANN401  SQLAlchemy's
    column, given = (compiler.process(one, **options) for one in element.clauses)
    return f"{column} = ANY ({given})"


@compiles(among)
def _in_json(element: among, compiler: SQLCompiler, **options: Any) -> str:  # noqa: ANN401  SQLAlchemy's
    column, given = (compiler.process(one, **options) for one in element.clauses)
    return f"{column} IN (SELECT value FROM json_each({given}))"


def latest(query: Select[R], number: InstrumentedAttribute[int], before: int | None, limit: int) -> Select[R]:
    """A page of rows in descending order of their number; `before` is the last number of the previous page."""
    if before is not None:
        query = query.where(number < before)
    return query.order_by(number.desc()).limit(limit)
