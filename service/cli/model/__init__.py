"""`menshin model`: models of the isolation layer held against records, without a database."""

import typer

from service.cli.current_settings import own_effects_in_force
from service.cli.model.add import add
from service.cli.model.compare import compare
from service.cli.model.diagnose import diagnose
from service.cli.model.fit import fit
from service.cli.model.improve import improve
from service.cli.model.new import new

app = typer.Typer(
    no_args_is_help=True,
    help="Models of the isolation layer, held against records.",
    callback=own_effects_in_force,
)
for command in (new, fit, compare, diagnose, add, improve):
    app.command()(command)
