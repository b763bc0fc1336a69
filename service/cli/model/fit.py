"""`menshin model fit`: the values that records ask for."""

from service.cli.model.arguments import Building, Files, HoldOut, Json, Model, Output
from service.cli.model.files import read_usable, refusing, write, write_json
from service.cli.progress_bar import waiting


def fit(
    model: Model,
    files: Files,
    building: Building,
    output: Output,
    hold_out: HoldOut = None,
    json: Json = None,
) -> None:
    """Fit a model's values to records, all of them at once.

    What the layer keeps passes from each earthquake to the next in the order of time. Says the values with their
    standard deviations, which of them the records cannot tell apart or not determine, and the error before and after.
    Exit code 0: fitted, also where a value is at the end of its range or not determined, which is said; 1: no record
    can be used.
    """
    from rich.console import Console

    from service.models.model_file import written
    from service.models.workbench.fit_json import as_json
    from service.models.workbench.fit_summary import summary
    from service.models.workbench.work import fit as fit_model

    with waiting() as tell:
        described, seen = read_usable(model, files, building, tell, hold_out or ())
        with refusing():
            found = fit_model(described, model.name, seen, tell)
    write(written(found.model), output)
    Console().print(summary(found))
    if json is not None:
        write_json(as_json(found), json)
