"""`menshin building export` and `import`: a building with everything it has, as one file."""

import os
import tempfile
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from service.cli.database import opened
from service.cli.inputs import REFUSED, current_settings, end, progress_bar

app = typer.Typer()


@app.command("export")
def export_building(
    context: typer.Context,
    code: Annotated[str, typer.Argument(help="Code of the building.")],
    file: Annotated[Path, typer.Argument(dir_okay=False, help="File to write, which must not exist.")],
    with_secrets: Annotated[
        bool,
        typer.Option("--with-secrets", help="Write passwords and secrets too; protect the file as you protect them."),
    ] = False,
) -> None:
    """Export a building with all its data to one file, for another installation.

    The file has descriptions, original files, records, analyses, models with their jobs, drift, alerts, messages and
    recipients, but no keys, sessions, links and audit trail. The service may run meanwhile.
    """
    from service.buildings.store import BuildingError
    from service.db.sessions import reading
    from service.transfer.exporting import export

    if file.exists():
        end(f"{file} exists already; name another file, or move it away", REFUSED)
    file.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=file.parent, prefix=f".{file.name}.")  # readable by its owner alone
    unfinished = Path(name)
    try:
        with opened(context) as sessions, os.fdopen(handle, "wb") as output:
            with progress_bar() as report_step, reading(sessions)() as session:
                manifest = export(
                    session,
                    code,
                    output,
                    datetime.now(UTC),
                    report_step,
                    with_secrets=with_secrets,
                    settings=current_settings().storage,
                )
            output.flush()
            os.fsync(output.fileno())
        unfinished.rename(file)
    except BuildingError as error:
        end(str(error), REFUSED)
    finally:
        unfinished.unlink(missing_ok=True)
    rows = sum(one.rows for one in manifest.tables.values())
    typer.echo(f"{file}: {manifest.building} with {rows} rows and {manifest.files} original files")
    if with_secrets:
        typer.echo("the file contains passwords and secrets", err=True)
    else:
        typer.echo("without passwords and secrets; the importing side updates the building with its file", err=True)


@app.command("import")
def import_building(
    context: typer.Context,
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, readable=True, help="File of `menshin building export`.")
    ],
) -> None:
    """Import a building from a file of `menshin building export`, completely or not at all.

    Exit code 0: imported; 1: a building of this code exists, or the file cannot be used.
    """
    from service.buildings.store import BuildingError
    from service.transfer import earlier, importing
    from service.transfer.archive import ArchiveError

    with opened(context) as sessions:
        try:
            with earlier.opened(file) as found, progress_bar() as report_step:
                importing.import_building(sessions, found, report_step, current_settings().storage)
        except (BuildingError, ArchiveError) as error:
            end(f"{file}: {error}", REFUSED)
    manifest = found.manifest
    typer.echo(f"{manifest.building} is monitored: {manifest.name}, exported {manifest.exported_at[:16]} UTC")
    if not manifest.with_secrets:
        typer.echo(
            f"without passwords and secrets: give them by `menshin building update {manifest.building} FILE`", err=True
        )
