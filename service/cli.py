"""The command `menshin`, assembled from its groups of commands."""

import typer

from service.commands import analyse, building, demo, drill, effects, keys, model, reproduce, run, secret
from service.commands.edge import Edge

app = typer.Typer(
    name="menshin",
    cls=Edge,
    no_args_is_help=True,
    pretty_exceptions_show_locals=False,
    help="Structural health monitoring for base-isolated buildings.",
)
for group in (demo, run, drill, analyse, reproduce, effects):
    app.add_typer(group.app)
app.add_typer(building.app, name="building")
app.add_typer(model.app, name="model")
app.add_typer(keys.app, name="key")
app.add_typer(secret.app, name="secret")
