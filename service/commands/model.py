"""`menshin model`: a model of the isolation layer held against records, without a database."""

from collections.abc import Iterator
from contextlib import contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.commands.described import described_by
from service.commands.in_force import own_effects_in_force, settings_in_force
from service.commands.waiting import waiting

if TYPE_CHECKING:
    from service.model_file import ModelFile
    from service.workbench.records import Records, Tell

REFUSED, USAGE = 1, 2

app = typer.Typer(
    no_args_is_help=True,
    help="Models of the isolation layer, held against records.",
    callback=own_effects_in_force,
)

Building = Annotated[Path, typer.Option(exists=True, dir_okay=False, help="Building file (TOML).")]
Model = Annotated[Path, typer.Argument(exists=True, dir_okay=False, metavar="MODEL", help="Model file (TOML).")]
Files = Annotated[
    list[Path],
    typer.Argument(
        exists=True,
        dir_okay=False,
        metavar="FILE...",
        help="Records as `menshin analyse` takes them; files that overlap in time are one earthquake.",
    ),
]
Json = Annotated[Path | None, typer.Option(dir_okay=False, help="Write all numbers here, in SI units.")]
Html = Annotated[Path | None, typer.Option(dir_okay=False, help="Write text, tables and pictures here, as one file.")]
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
    write(written(model), output)
    typer.echo(f"{output}: {', '.join(first.isolator.effects)}")
    if first.assumed:
        typer.echo(
            f"{', '.join(first.assumed)}: not given in [isolation.design], only a start; `menshin model fit` finds them"
        )


@app.command()
def compare(model: Model, files: Files, building: Building, json: Json = None, html: Html = None) -> None:
    """Hold a model against records: its errors, and where it fails.

    Driven by the measured motion its force is held against the estimated one; driven by the ground alone, the layer's
    displacement and the floors' accelerations against those measured. Exit code 0: compared; 1: no record can be used.
    """
    from rich.console import Console

    from service.workbench.comparison_json import as_json
    from service.workbench.held import held
    from service.workbench.page import page
    from service.workbench.summary import summary

    with waiting() as tell:
        described, seen = read(model, files, building, tell)
        with refusing():
            found = held(described, seen, tell)
    Console().print(summary(found))
    if json is not None:
        write_json(as_json(found), json)
    if html is not None:
        write(page(found), html)


def read(model: Path, files: list[Path], building: Path, tell: "Tell") -> tuple["ModelFile", "Records"]:
    """The model, and the records it is held against; what is wrong with either ends the command with its reason."""
    from core.analysis import AnalysisSettings
    from service.model_file import ModelFileError
    from service.model_file import read as read_model
    from service.workbench.records import records

    own = settings_in_force()
    of_building = described_by(building)
    try:
        described = read_model(model.read_text("utf-8"))
    except (ModelFileError, UnicodeDecodeError) as error:
        typer.echo(f"{model}:\n{error}", err=True)
        raise typer.Exit(USAGE) from None
    if described.building != of_building.description.code:
        message = (
            f"{model} is of building {described.building!r}, {building} describes {of_building.description.code!r}"
        )
        raise typer.BadParameter(message, param_hint="MODEL")
    settings = AnalysisSettings(estimator=own.estimator, rate=own.rate, band=own.band)
    with refusing():
        seen = records(files, of_building, described.directions, described.reference, settings, tell)
    if not seen.observations:
        typer.echo("\n".join(seen.unused) or "none of the files holds records", err=True)
        raise typer.Exit(REFUSED)
    return described, seen


@contextmanager
def refusing() -> Iterator[None]:
    """What cannot be computed ends the command with its reason."""
    from core.errors import CoreError
    from service.formats import FormatError

    try:
        yield
    except (CoreError, FormatError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(REFUSED) from None


def write_json(document: dict[str, object], path: Path) -> None:
    """JSON, indented."""
    import orjson

    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(orjson.dumps(document, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE))


def write(text: str, path: Path) -> None:
    """A text file, wherever its folder is."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
