"""`menshin model improve`: diagnose and add until nothing more is asked for."""

from service.cli.model.arguments import Building, Files, HoldOut, Html, Json, Model, Output
from service.cli.model.files import read_usable, refusing, write, write_json
from service.cli.progress_bar import waiting


def improve(
    model: Model,
    files: Files,
    building: Building,
    output: Output,
    hold_out: HoldOut = None,
    json: Json = None,
    html: Html = None,
) -> None:
    """Diagnose a model and add what the records ask for, again and again, until nothing more is asked for.

    An effect that does not lower the error on the earthquakes held out is not taken; where something unknown
    is missing, only one that lowers it is. The page is that of the first diagnosis.
    Exit code 0: done; 1: no record can be used.
    """
    from rich.console import Console

    from service.models.model_file import written
    from service.models.workbench.diagnosis_page import page
    from service.models.workbench.improving_output import as_json, summary
    from service.models.workbench.work import diagnosis, improve as improved

    with waiting() as tell:
        described, seen = read_usable(model, files, building, tell, hold_out or ())
        with refusing():
            found = improved(described, model.name, seen, tell)
    write(written(found.model), output)
    Console().print(summary(found))
    if json is not None:
        write_json(as_json(found), json)
    if html is not None:
        write(page(diagnosis(found.result.rounds[0], described, model.name)), html)
