"""What every answer is: SI units, UTC times; what is missing is null."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

Number = Annotated[float, Field(allow_inf_nan=False)]
Series = list[float | None]


class Answer(BaseModel):
    """Read from a row, and nothing else comes with it."""

    model_config = ConfigDict(from_attributes=True, extra="forbid")


class Problem(BaseModel):
    """What went wrong (RFC 9457)."""

    type: str = Field(description="Always about:blank: the status says it.", examples=["about:blank"])
    title: str = Field(description="The status in words.", examples=["Not Found"])
    status: int = Field(description="HTTP status.", examples=[404])
    detail: str = Field(description="What was found and what would do.", examples=["There is no building 'X'."])
    errors: list[dict[str, str]] | None = Field(
        None, description="Per parameter: `in`, `name`, `wanted`; for 422, and 404 of a path."
    )
