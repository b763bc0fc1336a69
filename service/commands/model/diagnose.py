"""`menshin model diagnose`: what a model lacks."""

from service.commands.model.arguments import Building, Files, HoldOut, Html, Json, Model
from service.commands.model.reading import read, refusing, write, write_json
from service.commands.waiting import waiting


def diagnose(
    model: Model,
    files: Files,
    building: Building,
    hold_out: HoldOut = None,
    json: Json = None,
    html: Html = None,
) -> None:
    """Say which physical effect a model lacks, by records: or that none is, or that none that is known would do.

    Every effect that the model has not is added to it and everything fitted anew. Says what would tell where the
    records do not, and tries the result on earthquakes held out. Nothing is changed: see `menshin model add`.
    Exit code 0: diagnosed; 1: no record can be used.
    """
    from rich.console import Console

    from service.workbench.diagnosing import diagnose as diagnose_model
    from service.workbench.diagnosis_json import as_json
    from service.workbench.diagnosis_page import page
    from service.workbench.diagnosis_summary import summary

    with waiting() as tell:
        described, seen = read(model, files, building, tell, hold_out or ())
        with refusing():
            found = diagnose_model(described, model.name, seen, tell)
    Console().print(summary(found))
    if json is not None:
        write_json(as_json(found), json)
    if html is not None:
        write(page(found), html)
