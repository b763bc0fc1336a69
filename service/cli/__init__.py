"""The command `menshin`, assembled from its groups of commands."""

from typing import Annotated

import typer

from service.cli import (
    analyse,
    backup,
    building,
    demo,
    doctor,
    drill,
    keys,
    model,
    report,
    reproduce,
    run,
    secret,
    status,
    storage,
    transfer,
)
from service.cli.edge import Edge

app = typer.Typer(
    name="menshin",
    cls=Edge,
    no_args_is_help=True,
    pretty_exceptions_show_locals=False,
    help="Structural health monitoring for base-isolated buildings.",
)
for group in (
    *(demo.app, run.app, status.app, doctor.app, backup.app, report.app, drill.app),
    *(analyse.app, reproduce.app, model.effects_app),
):
    app.add_typer(group)
building.app.add_typer(transfer.app)
app.add_typer(building.app, name="building")
app.add_typer(model.app, name="model")
app.add_typer(keys.app, name="key")
app.add_typer(secret.app, name="secret")
app.add_typer(storage.app, name="storage")


def _print_version(wanted: bool) -> None:
    if wanted:
        from service.version import VERSION

        typer.echo(f"menshin {VERSION}")
        raise typer.Exit


@app.callback()
def menshin(
    _: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_print_version, help="Print the version and end.")
    ] = False,
) -> None:
    """Structural health monitoring for base-isolated buildings."""
