"""`menshin model add`: one more effect."""

from typing import Annotated

import typer

from service.cli.model.arguments import Building, Files, HoldOut, Json, Model, Output
from service.cli.model.files import read_usable, refusing, write, write_json
from service.cli.progress_bar import waiting


def add(
    effect: Annotated[str, typer.Argument(metavar="EFFECT", help="Name; `menshin effects` lists them.")],
    model: Model,
    files: Files,
    building: Building,
    output: Output,
    hold_out: HoldOut = None,
    json: Json = None,
) -> None:
    """Add an effect to a model and fit everything anew; the error before and after says what it is worth.

    It is added whether the records ask for it or not, which is said.
    Exit code 0: added; 1: no record can be used; 2: no such effect, or the model has it already.
    """
    from rich.console import Console

    from service.models.model_file import written
    from service.models.workbench.adding_output import as_json, summary
    from service.models.workbench.work import add as added

    _check_known(effect)
    with waiting() as tell:
        described, seen = read_usable(model, files, building, tell, hold_out or ())
        if effect in described.isolator.effects:
            raise typer.BadParameter(f"{model} has {effect} already; `menshin model fit` fits it", param_hint="EFFECT")
        with refusing():
            found = added(effect, described, model.name, seen, tell)
    write(written(found.model), output)
    Console().print(summary(found))
    if json is not None:
        write_json(as_json(found), json)


def _check_known(effect: str) -> None:
    from core.effects import EFFECTS

    if effect not in EFFECTS:
        message = f"there is no effect {effect!r}; there are {', '.join(sorted(EFFECTS))}"
        raise typer.BadParameter(message, param_hint="EFFECT")
