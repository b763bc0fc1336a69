"""`menshin building`: the buildings under watch."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from service.commands.audited import of_command
from service.commands.described import text_of
from service.commands.in_force import settings_in_force

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from service.database import Building

app = typer.Typer(no_args_is_help=True, help="The buildings under watch.")

File = Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="Building file (TOML).")]
Code = Annotated[str, typer.Argument(help="Code of the building.")]


@app.command()
def add(context: typer.Context, file: File) -> None:
    """Put a building under watch."""
    from service import buildings

    text = text_of(file)
    with _session(context) as session:
        building = buildings.add(session, text, file.parent.resolve(), datetime.now(UTC))
        Console().print(f"{building.code} is under watch: {building.name}")
        _warn(session, building)


@app.command("list")
def every(context: typer.Context) -> None:
    """List the buildings under watch."""
    from sqlalchemy import select

    from service import buildings
    from service.database import Building

    table = Table("code", "name", "revision", "since (UTC)")
    with _session(context) as session:
        for building in session.scalars(select(Building).order_by(Building.code)):
            number = str(buildings.current(session, building).number)
            table.add_row(building.code, building.name, number, f"{building.created_at:%Y-%m-%d %H:%M}")
    Console().print(table)


@app.command()
def show(context: typer.Context, code: Code) -> None:
    """Print the description of a building, as its latest file gave it but for secrets."""
    from service import buildings, receivers
    from service.shown_addresses import without_credentials

    with _session(context) as session:
        found = buildings.find(session, code)
        rules = buildings.described(session, found).receivers
        text = receivers.without_secrets(buildings.current(session, found).toml, rules)
        typer.echo(without_credentials(text), nl=False)


@app.command()
def update(context: typer.Context, code: Code, file: File) -> None:
    """Give a building a new description; earlier results keep the one they were made with."""
    from service import buildings
    from service.toml_files import building_file

    text, folder = text_of(file), file.parent.resolve()
    with _session(context) as session:
        buildings.find(session, code)
        described = building_file.read(text, folder).description.code
        if described != code:
            raise buildings.BuildingError(f"{file} describes building {described!r}; a file of {code!r} would do")
        revision = buildings.update_description(session, text, folder, datetime.now(UTC))
        Console().print(f"{code} is described by revision {revision.number}")
        _warn(session, revision.building)


def _warn(session: "Session", building: "Building") -> None:
    """Warn of a folder that is not there yet, and of mail that cannot be sent; neither is an error."""
    from service import buildings

    source = buildings.described(session, building).source
    if source is not None and source.kind == "folder" and not os.path.isdir(source.location):
        typer.echo(
            f"warning: the folder {source.location} does not exist; make it, or correct location in the building file",
            err=True,
        )
    if settings_in_force().smtp_host is None and any(
        receiver.kind == "email" for receiver in buildings.described(session, building).receivers
    ):
        typer.echo("warning: no mail can be sent to the building's mail receivers: set smtp_host", err=True)


@contextmanager
def _session(context: typer.Context) -> Iterator["Session"]:
    """A transaction on the database of the settings; what is refused ends the command with exit code 1."""
    from service.buildings import BuildingError
    from service.migrate import upgrade
    from service.sessions import sessions
    from service.toml_files.building_file import BuildingFileError

    url = settings_in_force().database_url
    upgrade(url)
    made = sessions(url)
    try:
        with of_command(context, made).begin() as session:
            yield session
    except (BuildingFileError, BuildingError) as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from None
    finally:
        made.kw["bind"].dispose()
