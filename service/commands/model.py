"""`menshin model`: a model of the isolation layer held against records, without a database."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from service.commands.described import described_by
from service.commands.in_force import own_effects_in_force

app = typer.Typer(
    no_args_is_help=True,
    help="Models of the isolation layer, held against records.",
    callback=own_effects_in_force,
)

Building = Annotated[Path, typer.Option(exists=True, dir_okay=False, help="Building file (TOML).")]
Output = Annotated[Path, typer.Option("--output", "-o", dir_okay=False, help="Model file (TOML) to write.")]


class Direction(StrEnum):
    """Horizontal directions that a model may be of."""

    x = "x"
    y = "y"
    xy = "xy"


@app.command()
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
    from core.first_model import first_model
    from service.model_file import ModelFile, written

    description = described_by(building).description
    first = first_model(description)
    model = ModelFile(description.code, direction.value, first.isolator, assumed=first.assumed)
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(written(model), encoding="utf-8")
    typer.echo(f"{output}: {', '.join(first.isolator.effects)}")
    if first.assumed:
        typer.echo(
            f"{', '.join(first.assumed)}: not given in [isolation.design], only a start; `menshin model fit` finds them"
        )
