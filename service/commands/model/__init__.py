"""`menshin model`: models of the isolation layer held against records, without a database."""

import typer

from service.commands.in_force import own_effects_in_force
from service.commands.model.add import add
from service.commands.model.compare import compare
from service.commands.model.diagnose import diagnose
from service.commands.model.fit import fit
from service.commands.model.improve import improve
from service.commands.model.new import new

app = typer.Typer(
    no_args_is_help=True,
    help="Models of the isolation layer, held against records.",
    callback=own_effects_in_force,
)
for command in (new, fit, compare, diagnose, add, improve):
    app.command()(command)
