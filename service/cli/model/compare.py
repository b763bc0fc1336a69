"""`menshin model compare`: a model held against records."""

from service.cli.model.arguments import Building, Files, Html, Json, Model
from service.cli.model.files import read_usable, refusing, write, write_json
from service.cli.progress_bar import waiting


def compare(model: Model, files: Files, building: Building, json: Json = None, html: Html = None) -> None:
    """Hold a model against records: its errors, and where it fails.

    Driven by the measured motion its force is held against the estimated one; driven by the ground alone, the layer's
    displacement and the floors' accelerations against those measured. Exit code 0: compared; 1: no record can be used.
    """
    from rich.console import Console

    from service.models.workbench.comparison_json import as_json
    from service.models.workbench.page import page
    from service.models.workbench.summary import summary
    from service.models.workbench.work import compare as compare_model

    with waiting() as tell:
        described, seen = read_usable(model, files, building, tell)
        with refusing():
            found = compare_model(described, seen, tell)
    Console().print(summary(found))
    if json is not None:
        write_json(as_json(found), json)
    if html is not None:
        write(page(found), html)
