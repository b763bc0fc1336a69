"""`menshin analyse`: the service's chain on files, without a database."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from service.cli.inputs import (
    REFUSED,
    current_settings,
    description_digest,
    end,
    kept_analyses,
    levels_by_name,
    read_building,
    say_kept,
    write_json,
)

if TYPE_CHECKING:
    from core.analysis import AnalysisSettings, EventAnalysis
    from core.description import BuildingDescription
    from service.buildings.description import BuildingFile

app = typer.Typer()


@app.command()
def analyse(
    files: Annotated[
        list[Path],
        typer.Argument(
            exists=True,
            dir_okay=False,
            metavar="FILE...",
            help="Records (miniSEED, K-NET, KiK-net, SAC, CSMIP and COSMOS V2, CSV, or a zip of these) and StationXML; "
            "files that overlap in time are one event.",
        ),
    ],
    building: Annotated[Path, typer.Option(exists=True, dir_okay=False, help="Building file (TOML).")],
    json: Annotated[
        Path | None,
        typer.Option(help="Write the results here; several events get a file each, with the start in its name."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "--output", file_okay=False, help="Write histories (CSV) and figures (SVG, PNG) into this folder."
        ),
    ] = None,
    estimator: Annotated[
        str | None, typer.Option(help="Estimator of the restoring force; default: the setting of this name.")
    ] = None,
    sensors: Annotated[
        str | None,
        typer.Option(
            help="Levels to use, by name or role (base, roof = topmost), as in base,4,roof; default: every "
            "instrumented one."
        ),
    ] = None,
    integral: Annotated[
        str | None,
        typer.Option(
            help="Motion used from a displacement channel that was integrated from accelerations: recorded or "
            "restored; default: the setting of this name."
        ),
    ] = None,
) -> None:
    """Analyse the events in record files: restoring force, modes, equivalent stiffness and damping.

    Exit code 0: analysed; 1: an event or a file was refused; 2: wrong usage or building file.
    """
    from service.analyses.store import kept_analysis
    from service.formats import FormatError
    from service.records.event_files import events

    described = read_building(building)
    settings = _settings(estimator, sensors, integral, described.description)
    try:
        earthquakes = events(files, described)
    except FormatError as error:
        end(str(error), REFUSED)
    if not earthquakes:
        raise typer.BadParameter("none of the files contains records", param_hint="FILE...")
    stamps = [f"{event.start:%Y%m%dT%H%M%SZ}" if len(earthquakes) > 1 else "" for event in earthquakes]
    kept, digest = kept_analyses(), description_digest(building)
    results = [
        _shown(
            kept_analysis(event.segments, described.description, digest, settings, kept),
            described,
            settings,
            _stamped(json, stamp),
            out and out / stamp,
        )
        for event, stamp in zip(earthquakes, stamps, strict=True)
    ]
    say_kept(kept)
    if any(result.refusal is not None for result in results):
        raise typer.Exit(REFUSED)


def _shown(
    result: "EventAnalysis",
    building: "BuildingFile",
    settings: "AnalysisSettings",
    json: Path | None,
    out: Path | None,
) -> "EventAnalysis":
    """The analysis of one event, whose summary is printed, and the files that were requested are written."""
    from rich.console import Console

    from service.analyses.document import file_results
    from service.analyses.report import summary, write_files
    from service.documents.text import printed
    from service.verdict.measured import of_analysis
    from service.verdict.report import parts as verdict_parts
    from service.verdict.schema import verdict_out

    description = building.description
    assessment = of_analysis(result, description, building.limits)
    shown = summary(result, description)
    Console().print(printed(replace(shown, parts=(*shown.parts, *verdict_parts(assessment)))))
    if json is not None:
        write_json(file_results(result, description, settings, verdict_out(assessment)), json)
    if out is not None:
        write_files(result, description.code, out)
    return result


def _settings(
    estimator: str | None, sensors: str | None, integral: str | None, description: "BuildingDescription"
) -> "AnalysisSettings":
    """The service's own settings, so that both give the same results, and the command's options in their place."""
    from core.analysis import AnalysisSettings
    from core.estimators import ESTIMATORS
    from core.isolation_layer.motion import Integral

    own = current_settings().analysis
    chosen = own.estimator if estimator is None else estimator
    if chosen not in ESTIMATORS:
        known = ", ".join(ESTIMATORS)
        raise typer.BadParameter(f"no estimator {chosen!r}; there are {known}", param_hint="--estimator")
    levels = None if sensors is None else levels_by_name(sensors, description)
    if integral not in (None, *get_args(Integral)):
        raise typer.BadParameter(f"it is {' or '.join(get_args(Integral))}, not {integral!r}", param_hint="--integral")
    way = own.integral if integral is None else "restored" if integral == "restored" else "recorded"
    return AnalysisSettings(estimator=chosen, sensors=levels, rate=own.rate, band=own.band, integral=way)


def _stamped(path: Path | None, stamp: str) -> Path | None:
    return path.with_stem(f"{path.stem}-{stamp}") if path is not None and stamp else path
