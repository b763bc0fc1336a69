"""Schemas that all rooms share: values in SI units, times in UTC, null for missing values."""

from collections.abc import Iterable, Mapping
from math import isfinite
from typing import Annotated, Any, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, Field

Number = Annotated[float, Field(allow_inf_nan=False)]
Series = list[float | None]


class Answer(BaseModel):
    """A response, read from a row or an object; unknown fields are errors."""

    model_config = ConfigDict(from_attributes=True, extra="forbid")

    @classmethod
    def cells(cls, row: Mapping[str, Any]) -> Iterable[object]:
        """A row of this model in CSV, from its JSON."""
        return row.values()


def json_values(value: Any) -> Any:  # noqa: ANN401  any value of JSON
    """The same with null for every number that JSON does not have, and lists for tuples."""
    match value:
        case float():
            return float(value) if isfinite(value) else None
        case dict():
            return {key: json_values(member) for key, member in value.items()}
        case list() | tuple():
            return [json_values(member) for member in value]
    return value


Row = TypeVar("Row", bound=Answer)


class Page(Answer, Generic[Row]):
    """A page of a table."""

    items: list[Row] = Field(description="The rows of this page.")
    next: str | None = Field(description="Cursor of the next page; null after the last.")


class Problem(BaseModel):
    """A problem document (RFC 9457)."""

    type: str = Field(description="Always about:blank: the status identifies the problem.", examples=["about:blank"])
    title: str = Field(description="The status in words.", examples=["Not Found"])
    status: int = Field(description="HTTP status.", examples=[404])
    detail: str = Field(description="The problem and its remedy.", examples=["There is no building 'X'."])
    errors: list[dict[str, str]] | None = Field(
        None, description="Per parameter: `in`, `name`, `wanted`; for 422, and 404 of a path."
    )
