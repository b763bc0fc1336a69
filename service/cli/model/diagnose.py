"""`menshin model diagnose`: what a model lacks."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from service.cli.model.arguments import Building, Files, HoldOut, Html, Json, Model
from service.cli.model.files import read, refuse, refusing, write, write_json
from service.cli.progress_bar import waiting

if TYPE_CHECKING:
    from core.workbench.earthquakes import Earthquakes


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

    from service.models.workbench.diagnosis_json import as_json
    from service.models.workbench.diagnosis_page import page
    from service.models.workbench.diagnosis_summary import summary
    from service.models.workbench.work import diagnose as diagnose_model

    with waiting() as tell:
        described, seen = read(model, files, building, tell, hold_out or ())
        if not seen.observations:
            _end_with_suspicions(described.building, seen, json)
        with refusing():
            found = diagnose_model(described, model.name, seen, tell)
    Console().print(summary(found))
    if json is not None:
        write_json(as_json(found), json)
    if html is not None:
        write(page(found), html)


def _end_with_suspicions(building: str, seen: "Earthquakes", json: Path | None) -> None:
    """No record can be used: what is wrong with the sensors is the diagnosis, if anything is."""
    from core.diagnosis.suspicion import suspicions
    from core.workbench.diagnosing import fault_sentences
    from service.models.workbench.diagnosis_json import without_earthquakes

    found = () if seen.description is None else suspicions(seen.analyses, seen.description)
    if found:
        typer.echo("\n".join(fault_sentences(found)))
        if json is not None:
            write_json(without_earthquakes(building, found, seen.unused), json)
    refuse(seen)
