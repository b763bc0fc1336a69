"""The building, and its levels, that a command was given; what is wrong with them ends it with its reason."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from core.description import BuildingDescription
    from service.buildings.description import BuildingFile

USAGE = 2


def described_by(path: Path) -> "BuildingFile":
    """The building that a file describes; exit code 2 with all that is wrong with it."""
    from service.buildings.description import BuildingFileError, read

    try:
        return read(text_of(path), path.resolve().parent)
    except BuildingFileError as error:
        typer.echo(f"{path}:\n{error}", err=True)
        raise typer.Exit(USAGE) from None


def text_of(path: Path) -> str:
    """A text file; exit code 2 if it is none."""
    try:
        return path.read_text("utf-8")
    except UnicodeDecodeError as error:
        typer.echo(f"{path} is not text in UTF-8 ({error.reason} at byte {error.start}); save it as UTF-8", err=True)
        raise typer.Exit(USAGE) from None


def levels_named(sensors: str, description: "BuildingDescription") -> tuple[str, ...]:
    """The names of levels given by name or role, separated by commas."""
    from service.buildings.description import LevelError, named_levels

    try:
        return named_levels((name.strip() for name in sensors.split(",")), description)
    except LevelError as error:
        raise typer.BadParameter(str(error), param_hint="--sensors") from None
