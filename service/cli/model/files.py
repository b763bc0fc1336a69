"""Files that a command was given, and those that it writes; what is wrong with them ends it with its reason."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import typer

from service.cli.building_argument import described_by, text_of
from service.cli.current_settings import settings_in_force

if TYPE_CHECKING:
    from core.workbench.earthquakes import Earthquakes
    from service.jobs.progress import Tell
    from service.models.model_file import ModelFile

REFUSED, USAGE = 1, 2


def read(
    model: Path, files: list[Path], building: Path, tell: "Tell", left_out: Sequence[Path] = ()
) -> tuple["ModelFile", "Earthquakes"]:
    """The model, and the records it is held against; what is wrong with either ends the command with its reason."""
    from core.analysis import AnalysisSettings
    from service.models.model_file import ModelFileError, read as read_model
    from service.models.workbench.records import Reading, records

    own = settings_in_force()
    of_building = described_by(building)
    try:
        described = read_model(text_of(model))
    except ModelFileError as error:
        typer.echo(f"{model}:\n{error}", err=True)
        raise typer.Exit(USAGE) from None
    if described.building != of_building.description.code:
        message = (
            f"{model} is of building {described.building!r}, {building} describes {of_building.description.code!r}"
        )
        raise typer.BadParameter(message, param_hint="MODEL")
    settings = AnalysisSettings(estimator=own.analysis.estimator, rate=own.analysis.rate, band=own.analysis.band)
    reading = Reading(described.directions, described.reference, settings)
    with refusing():
        seen = records(files, left_out, of_building, reading, tell)
    return described, seen


def read_usable(
    model: Path, files: list[Path], building: Path, tell: "Tell", left_out: Sequence[Path] = ()
) -> tuple["ModelFile", "Earthquakes"]:
    """The same; that no record can be used ends the command with the reasons too."""
    described, seen = read(model, files, building, tell, left_out)
    if not seen.observations:
        refuse(seen)
    return described, seen


def refuse(seen: "Earthquakes") -> NoReturn:
    """Ends the command with the reasons why no record can be used."""
    typer.echo("\n".join(seen.unused) or "none of the files holds records", err=True)
    raise typer.Exit(REFUSED)


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
