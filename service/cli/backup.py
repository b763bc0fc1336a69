"""`menshin backup` and `menshin restore`: an SQLite database as one file."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from service.cli.inputs import REFUSED, current_settings, end, progress_bar

app = typer.Typer()


@app.command()
def backup(file: Annotated[Path, typer.Argument(dir_okay=False, help="File to write, which must not exist.")]) -> None:
    """Copy the SQLite database to a file while the service runs, and check the copy.

    For a PostgreSQL database, use pg_dump. Exit code 0: the copy is complete; 1: there is no copy, for the reason
    given.
    """
    from service.db import backup as backups

    try:
        with progress_bar() as report_step:
            size = backups.backup(current_settings().database_url, file, report_step)
    except backups.BackupError as error:
        end(str(error), REFUSED)
    typer.echo(f"{file}: {size / 1e6:.1f} MB, checked")
    files, outside = backups.files_outside(file)
    if files:
        store = current_settings().storage.originals
        typer.echo(
            f"{files} original files ({outside / 1e6:.1f} MB) are in {store}, not in this copy: back up that store "
            "after the database",
            err=True,
        )


@app.command()
def restore(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="File of `menshin backup`.")],
) -> None:
    """Replace the SQLite database with a backup; all processes of the service must be stopped.

    The replaced database is kept beside it. A backup of an earlier version is upgraded by the next command.
    """
    from service.db import backup as backups

    try:
        before = backups.restore(current_settings().database_url, file, datetime.now(UTC))
    except backups.BackupError as error:
        end(str(error), REFUSED)
    typer.echo(f"restored from {file}" + ("" if before is None else f"; the database before it is {before}"))
    if backups.files_outside(file)[0]:
        typer.echo("`menshin storage check` says whether the store has all original files that it names", err=True)
