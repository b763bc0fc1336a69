"""`menshin model` and `menshin effects`: models of the isolation layer compared with records, without a database."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from service.cli.inputs import (
    add_user_effects,
    end_without_records,
    progress_bar,
    read_building,
    read_records,
    read_usable_records,
    refusals,
    write_json,
    write_text,
)

if TYPE_CHECKING:
    from core.isolation_layer.motion import Integral
    from core.workbench.earthquakes import Earthquakes
    from service.documents.document import Document
    from service.jobs.stages import ReportStep
    from service.models.model_file import ModelFile
    from service.models.results import Head

TIMES = ["%Y-%m-%d", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%d %H:%M:%S"]
"""Forms of a time."""

app = typer.Typer(
    no_args_is_help=True, help="Models of the isolation layer, compared with records.", callback=add_user_effects
)
effects_app = typer.Typer()

Building = Annotated[Path, typer.Option(exists=True, dir_okay=False, help="Building file (TOML).")]
Model = Annotated[Path, typer.Argument(exists=True, dir_okay=False, metavar="MODEL", help="Model file (TOML).")]
Files = Annotated[
    list[Path],
    typer.Argument(
        exists=True,
        dir_okay=False,
        metavar="FILE...",
        help="Records in the formats of `menshin analyse`; files that overlap in time are one earthquake.",
    ),
]
Json = Annotated[Path | None, typer.Option(dir_okay=False, help="Write all numbers here, in SI units.")]
Html = Annotated[Path | None, typer.Option(dir_okay=False, help="Write text, tables and pictures here, as one file.")]
Output = Annotated[Path, typer.Option("--output", "-o", dir_okay=False, help="Model file (TOML) to write.")]
HoldOut = Annotated[
    list[Path] | None,
    typer.Option(
        "--hold-out",
        exists=True,
        dir_okay=False,
        help="A record of an earthquake that is not fitted but validates the result; may be repeated.",
    ),
]


class Motion(StrEnum):
    """Motion from a displacement channel that was integrated from accelerations."""

    recorded = "recorded"
    restored = "restored"


class Direction(StrEnum):
    """Horizontal directions of a model."""

    x = "x"
    y = "y"
    xy = "xy"


@app.command()
def new(
    building: Building,
    output: Output,
    direction: Annotated[
        Direction, typer.Option(help="x or y; xy for one set of values for both directions, which are coupled.")
    ] = Direction.x,
) -> None:
    """Write the first model of a building, from the design values in its file.

    The model is elastic, viscous and, if the yield force is given, hysteretic. Without design values it is linear, with
    initial values for a fit to records.
    """
    from core.model.first_model import first_model
    from service.models import texts
    from service.models.model_file import ModelFile

    description = read_building(building).description
    first = first_model(description)
    model = ModelFile(description.code, direction.value, first.isolator, assumed=first.assumed)
    measured = description.horizontal_directions
    if missing := [one for one in model.directions if one not in measured]:
        raise typer.BadParameter(texts.not_measured(description.code, missing, measured), param_hint="--direction")
    _write_model(model, output)
    typer.echo(f"{output}: {', '.join(first.isolator.effects)}")
    if first.assumed:
        typer.echo(
            f"{', '.join(first.assumed)}: not given in [isolation.design], only a start; `menshin model fit` fits them"
        )


@app.command()
def fit(
    model: Model,
    files: Files,
    building: Building,
    output: Output,
    hold_out: HoldOut = None,
    json: Json = None,
) -> None:
    """Fit a model's values to records, all of them at once.

    The layer's lasting states pass from each earthquake to the next in order of time. The command shows the values with
    their standard deviations, those that the records cannot distinguish or determine, and the error before and after.
    Exit code 0: fitted, even if a value is at the end of its range or not determined, which is shown; 1: no record can
    be used.
    """
    from service.models import documents, operations, report

    with _work(model, files, building, hold_out) as (given, records, report_step):
        done = operations.fit(given, model.name, records, report_step)
    _write_model(done.model, output)
    _show(report.fit(done), json, lambda: documents.fit(done))


@app.command()
def compare(model: Model, files: Files, building: Building, json: Json = None, html: Html = None) -> None:
    """Compare a model with records, and show its errors and where it fails.

    Driven by the measured motion, its force is compared with the estimated one; driven by the ground alone, the layer's
    displacement and the floors' accelerations with those measured. Exit code 0: compared; 1: no record can be used.
    """
    from service.models import documents, operations, report

    with _work(model, files, building) as (given, records, report_step):
        done = operations.compare(given, records, report_step)
    _show(
        report.comparison(done),
        json,
        lambda: documents.comparison(done),
        html,
        lambda: report.comparison_file(done),
    )


@app.command()
def forecast(
    model: Model,
    motions: Annotated[
        list[Path],
        typer.Argument(
            exists=True,
            dir_okay=False,
            metavar="MOTION...",
            help="Files with ground motions: the ground's records of the building, or any accelerations whose channel "
            "codes end with X, Y, Z or E, N, Z (east is x). Files of single components of one station are one motion.",
        ),
    ],
    building: Building,
    record: Annotated[
        list[Path],
        typer.Option(
            exists=True,
            dir_okay=False,
            help="A record that the model was fitted to; may be repeated. Records give the intervals and the range.",
        ),
    ],
    hold_out: HoldOut = None,
    pga: Annotated[
        str | None, typer.Option(help="Scale to this peak ground acceleration, such as '400 gal' or '4 m/s**2'.")
    ] = None,
    displacement: Annotated[
        str | None, typer.Option(help="Scale until the isolators move this far, such as '300 mm'.")
    ] = None,
    design_spectrum: Annotated[
        bool, typer.Option("--design-spectrum", help="Scale to the design spectrum of the building file.")
    ] = False,
    at: Annotated[
        datetime | None,
        typer.Option(help="Time of the earthquake, UTC; default: the end of the last record.", formats=TIMES),
    ] = None,
    temperature: Annotated[
        float | None,
        typer.Option(help="Temperature of the isolators in °C; default: the middle of the range in the records."),
    ] = None,
    json: Json = None,
    html: Html = None,
) -> None:
    """Forecast the response of isolators and floors to ground motions, with 95 % intervals.

    The intervals include the covariance of the model's values and the model's own error in the records. The command
    shows the margin to each limit of the building file, and where a motion leaves the range of the records. Exit code
    0: forecast, even if out of range, which is shown; 1: a record or a motion cannot be used.
    """
    from service.models import forecast_results, forecasting, report
    from service.models.motions import motions as read_motions, scaling

    described = read_building(building)
    with refusals():
        wanted = scaling(pga, displacement, design_spectrum, described)
        given_motions = read_motions(motions, described)
    with _work(model, record, building, hold_out) as (given, records, report_step):
        moment = None if at is None else at.replace(tzinfo=UTC)
        done = forecasting.forecast(given, records, given_motions, described, wanted, moment, temperature, report_step)
    _show(
        report.forecast(done),
        json,
        lambda: forecast_results.document(done),
        html,
        lambda: report.forecast_file(done),
    )


@app.command()
def diagnose(
    model: Model,
    files: Files,
    building: Building,
    hold_out: HoldOut = None,
    direction: Annotated[
        Direction, typer.Option(help="Direction to diagnose separately; xy: each direction that the records have.")
    ] = Direction.xy,
    json: Json = None,
    html: Html = None,
) -> None:
    """Name the physical effect that a model lacks, from records: one, none, or an unknown one.

    Each effect that the model does not have is added in turn, and everything is fitted again. If the records do not
    decide, the command shows what would. It validates the result on held-out earthquakes. It does not change the model:
    see `menshin model add`. Exit code 0: diagnosed; 1: no record can be used.
    """
    from core.workbench.correcting import corrected_copy
    from service.models import documents, operations, report

    with progress_bar() as report_step:
        given, records = read_records(model, files, building, report_step, hold_out or ())
        records = corrected_copy(records, report_step)
        if not records.observations:
            _end_with_faults(given.building, records, json)
        with refusals():
            wanted: tuple[Literal["x", "y"], ...] = tuple(one for one in ("x", "y") if one in direction.value)
            done = operations.diagnose(given, model.name, records, report_step, directions=wanted)
    _show(report.diagnosis(done), json, lambda: documents.diagnosis(done), html, lambda: report.diagnosis_file(done))


def _end_with_faults(building: str, records: "Earthquakes", json: Path | None) -> None:
    """End the command without usable records; faults of the sensors, if there are any, are the diagnosis."""
    from core.diagnosis.building_faults import building_faults
    from core.workbench.diagnosis_result import fault_sentences
    from service.models.documents import diagnosis_without_records
    from service.models.results import as_json

    faults = () if records.description is None else building_faults(records.analyses, records.description)
    if faults:
        typer.echo("\n".join(fault_sentences(faults)))
        if json is not None:
            write_json(as_json(diagnosis_without_records(building, faults, records.unused)), json)
    end_without_records(records)


@app.command()
def sketch(
    model: Model,
    files: Files,
    building: Building,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            dir_okay=False,
            metavar="NAME.py",
            help="File to write the effect to; its name becomes the effect's name.",
        ),
    ],
    hold_out: HoldOut = None,
    json: Json = None,
    html: Html = None,
) -> None:
    """Sketch the force that a model lacks if no known effect explains it.

    The command shows the missing force, what it depends on, and the simplest law that lowers two errors on held-out
    earthquakes: that of the force, and that of the response to the ground motion alone. The law is written as an
    effect. If the file is in the folder of the setting effects_folder, `menshin model add NAME` adds it to the model.
    Without --hold-out, the second strongest earthquake is held out. Exit code 0: sketched; if nothing is proposed, no
    file is written; 1: no record can be used; 2: an effect cannot have this name.
    """
    from core import workbench
    from core.effects import EFFECTS
    from service.models import report, sketch_results

    name = output.stem
    if output.suffix != ".py" or not name.isidentifier() or name in EFFECTS:
        message = f"{output} must be NAME.py, with an unused name of letters, digits and _"
        raise typer.BadParameter(message, param_hint="--output")
    with _work(model, files, building, hold_out) as (given, records, report_step):
        result = workbench.sketch(given.isolator, records, name=name, progress=report_step)
    if result.proposal is not None:
        write_text(result.proposal.source, output)
    _show(
        report.sketch(given, result),
        json,
        lambda: sketch_results.document(given, result),
        html,
        lambda: report.sketch_file(given, result),
    )


@app.command()
def add(
    effect: Annotated[str, typer.Argument(metavar="EFFECT", help="Name; `menshin effects` lists them.")],
    model: Model,
    files: Files,
    building: Building,
    output: Output,
    hold_out: HoldOut = None,
    json: Json = None,
) -> None:
    """Add an effect to a model and fit everything again; the error before and after shows its benefit.

    The effect is added whether or not the records support it, and the result says which.
    Exit code 0: added; 1: no record can be used; 2: no such effect, or the model has it already.
    """
    from service.models import documents, operations, report

    _check_known(effect, "EFFECT")
    with _work(model, files, building, hold_out) as (given, records, report_step):
        if effect in given.isolator.effects:
            raise typer.BadParameter(f"{model} has {effect} already; `menshin model fit` fits it", param_hint="EFFECT")
        done = operations.add(effect, given, model.name, records, report_step)
    _write_model(done.model, output)
    _show(report.change(done), json, lambda: documents.extension(done))


@app.command()
def improve(
    model: Model,
    files: Files,
    building: Building,
    output: Output,
    hold_out: HoldOut = None,
    integral: Annotated[
        Motion | None,
        typer.Option(
            help="Motion used from a displacement channel that was integrated from accelerations; default: as the "
            "model file says, or else restored."
        ),
    ] = None,
    json: Json = None,
    html: Html = None,
) -> None:
    """Diagnose a model and add the effect that the records support, until there is no further one.

    An effect that does not lower the error on held-out earthquakes is not added. If something unknown is missing, the
    stronger of the other earthquakes are predicted from the weaker ones, and effects are added as long as this
    prediction improves, which takes minutes. If the displacement was integrated from accelerations, its slow motion is
    restored; the model file says so, and commands that read it do the same. The HTML file ends with the first
    diagnosis. Exit code 0: done; 1: no record can be used.
    """
    from service.models import documents, operations, report

    way: Integral | None = None
    if integral is not None:
        way = "restored" if integral is Motion.restored else "recorded"
    with _work(model, files, building, hold_out, way, "restored") as (given, records, report_step):
        done = operations.improve(given, model.name, records, report_step)
    _write_model(done.model, output)
    _show(
        report.change(done),
        json,
        lambda: documents.improvement(done),
        html,
        lambda: report.improvement_file(done, operations.work(done.result.rounds[0], given, model.name)),
    )


def _write_model(model: "ModelFile", output: Path) -> None:
    from service.models.model_file import written

    write_text(written(model), output)


def _show(
    shown: "Document",
    json: Path | None,
    document: "Callable[[], Head]",
    html: Path | None = None,
    file: "Callable[[], Document] | None" = None,
) -> None:
    """Print a result, and write the files that were requested."""
    from rich.console import Console

    from service.documents.text import printed

    Console().print(printed(shown))
    if json is not None:
        from service.models.results import as_json

        write_json(as_json(document()), json)
    if html is not None and file is not None:
        from service.documents.html import page

        write_text(page(file()), html)


@effects_app.command()
def effects(
    name: Annotated[str | None, typer.Argument(help="Name of an effect; default: list all by family.")] = None,
) -> None:
    """Explain the effects that a model of the isolation layer may have: law, parameters, and signs of it."""
    from rich.console import Console

    from core.effects import EFFECTS
    from service.models.effects import overview, sheet

    add_user_effects()
    if name is not None:
        _check_known(name, "NAME")
    Console().print(overview(EFFECTS) if name is None else sheet(name, EFFECTS[name]))


def _check_known(effect: str, argument: str) -> None:
    from core.effects import EFFECTS

    if effect not in EFFECTS:
        message = f"there is no effect {effect!r}; there are {', '.join(sorted(EFFECTS))}"
        raise typer.BadParameter(message, param_hint=argument)


@contextmanager
def _work(
    model: Path,
    files: list[Path],
    building: Path,
    hold_out: list[Path] | None = None,
    integral: "Integral | None" = None,
    usual: "Integral | None" = None,
) -> Iterator[tuple["ModelFile", "Earthquakes", "ReportStep"]]:
    """A model, usable records and a progress bar; a refusal ends the command with its reason."""
    with progress_bar() as report_step:
        given, records = read_usable_records(model, files, building, report_step, hold_out or (), integral, usual)
        with refusals():
            yield given, records, report_step
