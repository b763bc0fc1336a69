"""`menshin effects`: the physical effects that a model may have."""

from typing import Annotated

import typer

from service.cli.current_settings import own_effects_in_force

app = typer.Typer()


@app.command()
def effects(
    name: Annotated[str | None, typer.Argument(help="Of one effect; without it all are listed, by family.")] = None,
) -> None:
    """Explain the effects that a model of the isolation layer may have: law, parameters, when to suspect one."""
    from rich.console import Console

    from core.effects import EFFECTS
    from service.models.workbench.effect_sheets import overview, sheet

    own_effects_in_force()
    if name is not None and name not in EFFECTS:
        message = f"there is no effect {name!r}; there are {', '.join(sorted(EFFECTS))}"
        raise typer.BadParameter(message, param_hint="NAME")
    Console().print(overview(EFFECTS) if name is None else sheet(name, EFFECTS[name]))
