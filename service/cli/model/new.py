"""`menshin model new`: the first model of a building."""

from enum import StrEnum
from typing import Annotated

import typer

from service.cli.building_argument import described_by
from service.cli.model.arguments import Building, Output
from service.cli.model.files import write


class Direction(StrEnum):
    """Horizontal directions that a model may be of."""

    x = "x"
    y = "y"
    xy = "xy"


def new(
    building: Building,
    output: Output,
    direction: Annotated[
        Direction, typer.Option(help="x or y; xy for one set of values that holds in both, each seeing the other.")
    ] = Direction.x,
) -> None:
    """Write the first model of a building, from its file's design values.

    Elastic, viscous and, where the yield force is given, hysteretic. Without design values it is a linear start, which
    wants a fit to records.
    """
    from core.fitting.first_model import first_model
    from service.models.model_file import ModelFile, written

    description = described_by(building).description
    first = first_model(description)
    model = ModelFile(description.code, direction.value, first.isolator, assumed=first.assumed)
    measured = description.horizontal_directions
    if missing := [one for one in model.directions if one not in measured]:
        raise typer.BadParameter(
            f"{description.code} does not measure direction {' and '.join(missing)}; it measures "
            f"{' and '.join(measured) or 'neither'}",
            param_hint="--direction",
        )
    write(written(model), output)
    typer.echo(f"{output}: {', '.join(first.isolator.effects)}")
    if first.assumed:
        typer.echo(
            f"{', '.join(first.assumed)}: not given in [isolation.design], only a start; `menshin model fit` finds them"
        )
