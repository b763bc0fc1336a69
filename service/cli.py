"""The command `menshin`, assembled from its groups of commands."""

import typer

from service.commands import analyse, building

app = typer.Typer(
    name="menshin",
    no_args_is_help=True,
    pretty_exceptions_show_locals=False,
    help="Structural health monitoring for base-isolated buildings.",
)
app.add_typer(analyse.app)
app.add_typer(building.app, name="building")
