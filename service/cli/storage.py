"""`menshin storage`: original files in the database, a folder or an S3-compatible store."""

from typing import Annotated

import typer

from service.cli.database import opened
from service.cli.inputs import REFUSED, USAGE, current_settings, end, progress_bar

app = typer.Typer(no_args_is_help=True, help="Original files in the database, a folder or an S3-compatible store.")

UNKNOWN = (
    "Files in the store that belong to nothing in this database: {}. An import that failed or a process that was ended "
    "left them, or the database was restored and is older. Delete them if they are not needed."
)


@app.command()
def move(
    context: typer.Context,
    to_store: Annotated[
        bool | None,
        typer.Option(
            "--to-store/--to-database", help="Destination: the store of `storage.originals`, or the database."
        ),
    ] = None,
) -> None:
    """Move all original files between the database and the store of `storage.originals`.

    The service may run meanwhile. If the command is stopped, the next one continues where it stopped. Files that move
    into the database stay in the store as well, until you delete them there.
    """
    from service.records import originals

    if to_store is None:
        raise typer.BadParameter("choose --to-store or --to-database")
    settings = current_settings().storage
    with opened(context) as sessions:
        if settings.originals is None:
            end("storage.originals is not set: it names the store", USAGE)
        with progress_bar() as report_step:
            moved = originals.move(sessions, settings, report_step, to_store=to_store)
    where = settings.originals if to_store else "the database"
    typer.echo(f"{moved.files} original files moved to {where}, {moved.size / 1e6:.1f} MB")


@app.command()
def check(context: typer.Context) -> None:
    """Read every original file in the store and compare it with its SHA-256; name files that do not belong there.

    Exit code 0: all are intact; 1: some are missing or damaged; their names are printed.
    """
    from service.records import originals
    from service.records.file_store import store_of

    settings = current_settings().storage
    with opened(context) as sessions:
        with sessions() as session:
            there = originals.outside(session)
        with progress_bar() as report_step:
            lost = originals.check(sessions, settings, report_step)
        unknown = originals.unknown(sessions, settings)
    if (store := store_of(settings)) is not None and (left := store.sweep()):
        typer.echo(f"{left} unfinished files, left by processes that were ended, are removed")
    if unknown:
        typer.echo("\n".join([*unknown, UNKNOWN.format(len(unknown))]))
    if lost:
        end("\n".join([*lost, f"{len(lost)} of {there.files} original files in the store are lost"]), REFUSED)
    typer.echo(f"{there.files} original files in the store are whole, {there.size / 1e6:.1f} MB")
