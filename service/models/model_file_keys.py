"""Which keys a model file may have, and what each means."""

from datetime import UTC, datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from service.formats.toml_problems import Table

Directions = Literal["x", "y", "xy"]


def _aware(moment: datetime) -> datetime:
    if moment.tzinfo is None:
        raise ValueError("it has no offset from UTC; 2024-03-05T06:07:08Z would do")
    return moment.astimezone(UTC)


Values = dict[str, dict[str, float]]
Deviations = dict[str, dict[str, Annotated[float, Field(ge=0, allow_inf_nan=True)]]]
Text = Annotated[str, Field(min_length=1)]


class ModelTable(Table):
    """The top of the file: the model."""

    building: Text = Field(description="code of the building whose isolation layer it is of")
    direction: Directions = Field(
        description="x or y: of the one horizontal direction; xy: the same values hold in both, and an effect that "
        "couples the directions sees each from the other"
    )
    reference: Annotated[datetime, AfterValidator(_aware)] | None = Field(
        default=None,
        description="date and time with offset, from which effects count time; default: the start of the first record",
    )
    parent: Text | None = Field(default=None, description="the model that this one was made from, by its file's name")
    assumed: list[Text] = Field(
        default=[], description="parameters that nobody gave or measured: they only make a start for a fit"
    )
    fitted_to: list[Text] = Field(
        default=[], description="earthquakes that the values were fitted to, by the start of their records"
    )
    effects: Values = Field(description="a table for each effect, with the value of every one of its parameters, SI")
    standard_deviations: Deviations = Field(
        default={}, description="the same for their standard deviations; inf where the records did not determine it"
    )
