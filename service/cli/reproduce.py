"""`menshin reproduce`: the paper's sections 7 and 8, computed again."""

import shlex
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from service.cli.inputs import current_settings, levels_by_name, read_building, refusals, write_text

if TYPE_CHECKING:
    from service.reproduction.real import RealBuilding
    from service.reproduction.simulated import Ground

PLACES = ("output", "markdown")
"""Options that do not change what is printed."""

app = typer.Typer()


@app.command()
def reproduce(
    context: typer.Context,
    files: Annotated[
        list[Path] | None,
        typer.Argument(
            exists=True,
            dir_okay=False,
            metavar="FILE...",
            help="Records of a real building for section 8, in the formats of `menshin analyse`; without them, section "
            "8 is left out.",
        ),
    ] = None,
    building: Annotated[
        Path | None, typer.Option(exists=True, dir_okay=False, help="Building file (TOML) of these records.")
    ] = None,
    sensors: Annotated[
        str | None,
        typer.Option(
            help="Levels of that building to use, by name or role, as in base,4,roof; default: the base slab, a floor "
            "in the middle and the topmost one, as in the paper."
        ),
    ] = None,
    ground: Annotated[
        Path | None,
        typer.Option(
            exists=True,
            dir_okay=False,
            help="Ground motion of section 7; its peak is scaled to the paper's 70.13 gal. Default: AKT013, Akita "
            "1996, which comes with ObsPy.",
        ),
    ] = None,
    channel: Annotated[str | None, typer.Option(help="Channel of --ground, if it has several.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the sensors' noise in section 7.")] = 1,
    output: Annotated[
        Path, typer.Option("--output", "-o", dir_okay=False, help="The figures, as one HTML file.")
    ] = Path("reproduction.html"),
    markdown: Annotated[
        Path | None, typer.Option(dir_okay=False, help="Write the printed tables into this file too, as Markdown.")
    ] = None,
) -> None:
    """Reproduce sections 7 and 8 of the paper: each number beside Menshin's, and figures 6 to 16 and 18 to 24.

    Section 7 uses the paper's simulated building and needs no files. The steps of section 8 are applied to the records
    of a real building, if they are given. The command takes about a minute.
    """
    from time import monotonic

    from rich.console import Console

    from service.documents.html import page
    from service.documents.text import markdown as as_markdown, printed
    from service.reproduction import report
    from service.reproduction.simulated import simulated

    console, began = Console(), monotonic()
    for place in (output, *([] if markdown is None else [markdown])):
        place.parent.mkdir(parents=True, exist_ok=True)
    with refusals(), console.status("reading") as status:
        motion = _ground(ground, channel)
        compute_eight = None if building is None and not files else _real(files or [], building, sensors)
        seven = simulated(motion, seed, status.update)
        eight = None if compute_eight is None else compute_eight(status.update)
        status.update("drawing")
        sections = report.sections(seven, eight)
        write_text(page(report.page(sections)), output)
    console.print(printed(report.summary(sections)))
    if markdown is not None:
        write_text(as_markdown(report.printed(sections, _command(context))), markdown)
    console.print(f"\nfigures: {output}, after {monotonic() - began:.0f} s", soft_wrap=True)


def _ground(path: Path | None, channel: str | None) -> "Ground":
    from service.reproduction.simulated import default_ground, ground_of_file

    if path is None and channel is not None:
        raise typer.BadParameter("it names a channel of --ground, which is missing", param_hint="--channel")
    return default_ground() if path is None else ground_of_file(path, channel)


def _real(
    files: list[Path], building: Path | None, sensors: str | None
) -> Callable[[Callable[[str], None]], "RealBuilding"]:
    """Computation of section 8, whose files are read at once: an error in them is reported before section 7 runs."""
    from core.analysis import AnalysisSettings
    from service.records.event_files import events
    from service.reproduction.real import real

    if building is None or not files:
        raise typer.BadParameter("section 8 needs both records and --building", param_hint="FILE...")
    own = current_settings().analysis
    described = read_building(building)
    levels = None if sensors is None else levels_by_name(sensors, described.description)
    settings = AnalysisSettings(rate=own.rate, band=own.band)
    earthquakes = events(files, described)
    return lambda report_step: real(earthquakes, described.description, levels, settings, report_step)


def _command(context: typer.Context) -> str:
    """The command to repeat, without the options for its output."""
    words = ["menshin", context.info_name or ""]
    for parameter in context.command.params:
        value = context.params.get(parameter.name or "")
        if parameter.name in PLACES or value is None or value == parameter.default:
            continue
        names = parameter.opts[:1] if parameter.param_type_name == "option" else []
        words += [*names, *map(str, value if isinstance(value, list) else [value])]
    return shlex.join(words)
