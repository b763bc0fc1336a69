"""Paging of tables: parameters, and a page as its model with the cursor of the next one."""

from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Annotated, Any, TypeVar, get_args

from fastapi import Query
from pydantic import BaseModel

from service.db.select import Line, Place
from service.http.parameters import LARGEST
from service.schema import Answer

M = TypeVar("M", bound=BaseModel)

Cursor = Annotated[
    str | None,
    Query(
        description="`next` of the page before.", pattern=r"^-?[0-9]{1,16}_[0-9]{1,9}$", examples=["1267252451000000_1"]
    ),
]
AfterCode = Annotated[
    str | None,
    Query(description="`next` of the page before.", pattern=r"^[A-Za-z0-9_-]{1,32}$", examples=["BNCS"]),
]
Before = Annotated[int | None, Query(description="`next` of the page before.", ge=1, le=LARGEST)]
Limit = Annotated[int, Query(description="Rows of a page.", ge=1, le=500)]
RowLimit = Annotated[int, Query(description="Rows of a page.", ge=1, le=20_000)]


def place(cursor: str | None) -> Place | None:
    """The end of the previous page."""
    return None if cursor is None else Place.read(cursor)


def next_place(rows: Sequence[tuple[datetime, int]], limit: int) -> str | None:
    """The cursor of the next page from the times and numbers of these rows; None if the page is not full."""
    return str(Place(*rows[-1])) if len(rows) == limit else None


def next_code(codes: Sequence[str], limit: int) -> str | None:
    """The same for a list by code."""
    return codes[-1] if len(codes) == limit else None


def next_number(numbers: Sequence[int], limit: int) -> str | None:
    """The same for a list in descending order of numbers."""
    return str(numbers[-1]) if len(numbers) == limit and numbers[-1] > 1 else None


def rows_of(model: type[M], rows: Iterable[Sequence[Any]], following: str | None = None, **context: object) -> M:
    """A page of a table.

    Args:
        model: the page's model, with `items` and `next`.
        rows: values in the order of the fields of the items' model.
        following: the cursor of the next page; None after the last.
        context: the other fields of the model.
    """
    columns = row_model(model).model_fields
    items = [dict(zip(columns, row, strict=True)) for row in rows]
    return model.model_validate(context | {"items": items, "next": following})


def page_by_number(model: type[M], items: Sequence[Any], limit: int, **context: object) -> M:
    """A page of rows in descending order of `id`."""
    following = next_number([row.id for row in items], limit)
    return model.model_validate(context | {"items": items, "next": following})


def page_by_event(model: type[M], lines: Sequence[Line], limit: int, **context: object) -> M:
    """A page of a history in order of time: `event_start` is a column, and the last one is the row's id."""
    following = next_place([(line.event_start, line.id) for line in lines], limit)
    return rows_of(model, [line[:-1] for line in lines], following, **context)


def row_model(model: type[BaseModel]) -> type[Answer]:
    """The model of the rows of a page."""
    row: type[Answer] = get_args(model.model_fields["items"].annotation)[0]
    return row
