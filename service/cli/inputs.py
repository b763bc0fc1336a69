"""Input and output of commands: settings, building and model files, records, results.

A wrong input ends the command with its reason: exit code 2 for settings and files that are malformed, 1 for records
that cannot be used.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from tomllib import TOMLDecodeError
from typing import TYPE_CHECKING, Any, NoReturn

import typer

if TYPE_CHECKING:
    from pydantic_core import ErrorDetails

    from core.description import BuildingDescription
    from core.isolation_layer.motion import Integral
    from core.workbench.earthquakes import Earthquakes
    from service.buildings.description import BuildingFile
    from service.jobs.kept import Kept
    from service.jobs.stages import ReportStep
    from service.models.model_file import ModelFile
    from service.settings import Settings

REFUSED, USAGE = 1, 2


def end(reason: str, code: int) -> NoReturn:
    """End the command with a reason."""
    typer.echo(reason, err=True)
    raise typer.Exit(code) from None


def current_settings(
    *,
    port: int | None = None,
    workers: int | None = None,
    executor: str | None = None,
    dask_address: str | None = None,
) -> "Settings":
    """The command's options, unless None, over the environment, the file and the defaults."""
    from pydantic import ValidationError

    from service.settings import Settings, settings_file

    given: dict[str, Any] = {} if port is None else {"port": port}
    of_jobs = {"workers": workers, "executor": executor, "dask_address": dask_address}
    if of_jobs := {name: value for name, value in of_jobs.items() if value is not None}:
        given["jobs"] = of_jobs
    try:
        return Settings(**given)
    except ValidationError as error:
        end("\n".join(map(_problem, error.errors())), USAGE)
    except TOMLDecodeError as error:
        end(f"{settings_file()} is not TOML: {error}", USAGE)
    except UnicodeDecodeError as error:
        end(f"{settings_file()} is not text in UTF-8 ({error.reason} at byte {error.start})", USAGE)
    except OSError as error:
        end(str(error) if error.strerror is None else f"{error.filename}: {error.strerror}", USAGE)
    except ValueError as error:
        end(str(error), USAGE)


def _problem(wrong: "ErrorDetails") -> str:
    """A line about a wrong setting; it repeats no secret, nor a whole group, which may hold one."""
    from service.formats.toml_problems import unknown
    from service.settings import SECRETS, settings_by_name

    name = ".".join(map(str, wrong["loc"]))
    if wrong["type"] == "extra_forbidden":
        return f"{name}: {unknown(name, list(settings_by_name()))}"
    is_shown = name and name not in SECRETS and not isinstance(wrong["input"], dict)
    got = f", got {wrong['input']!r}" if is_shown else ""
    return f"{name or 'settings'}: {wrong['msg'].removeprefix('Value error, ')}{got}"


def add_user_effects() -> None:
    """Make the user's own effects known, see service.user_effects."""
    from core.errors import ModelError
    from service.user_effects import add_user_effects

    try:
        add_user_effects(current_settings().effects_folder)
    except ModelError as error:
        end(str(error), USAGE)


def read_text(path: Path) -> str:
    """The text of a file."""
    try:
        return path.read_text("utf-8")
    except UnicodeDecodeError as error:
        end(f"{path} is not text in UTF-8 ({error.reason} at byte {error.start}); save it as UTF-8", USAGE)


def read_building(path: Path) -> "BuildingFile":
    """The building that a file describes; all problems of the file end the command."""
    from service.buildings.description import BuildingFileError, read

    try:
        return read(read_text(path), path.resolve().parent)
    except BuildingFileError as error:
        end(f"{path}:\n{error}", USAGE)


def levels_by_name(sensors: str, description: "BuildingDescription") -> tuple[str, ...]:
    """The names of levels that are given by name or role, separated by commas."""
    from service.buildings.description import LevelError, named_levels

    try:
        return named_levels((name.strip() for name in sensors.split(",")), description)
    except LevelError as error:
        raise typer.BadParameter(str(error), param_hint="--sensors") from None


def read_records(
    model: Path,
    files: list[Path],
    building: Path,
    report_step: "ReportStep",
    held_out: Sequence[Path] = (),
    integral: "Integral | None" = None,
    usual: "Integral | None" = None,
) -> tuple["ModelFile", "Earthquakes"]:
    """A model and the records for it; some or all of the records may be unusable.

    Args:
        model: model file.
        files: records to fit or compare.
        building: building file.
        report_step: called with the progress.
        held_out: records of earthquakes that nothing is fitted to.
        integral: motion from a displacement channel that was integrated from accelerations; None: as the model file
            says, else `usual`.
        usual: the same where neither says it; None: the setting.
    """
    from core.analysis import AnalysisSettings
    from service.models.model_file import ModelFileError, read as read_model
    from service.models.operations import Reading, records

    own = current_settings().analysis
    described = read_building(building)
    try:
        read = read_model(read_text(model))
    except ModelFileError as error:
        end(f"{model}:\n{error}", USAGE)
    if read.building != (code := described.description.code):
        message = f"{model} is of building {read.building!r}, {building} describes {code!r}"
        raise typer.BadParameter(message, param_hint="MODEL")
    way = integral or read.integral or usual or own.integral
    settings = AnalysisSettings(estimator=own.estimator, rate=own.rate, band=own.band, integral=way)
    kept = kept_analyses()
    with refusals():
        reading = Reading(read.directions, read.reference, settings, description_digest(building), kept)
        found = records(files, held_out, described, reading, report_step)
    say_kept(kept)
    return read, found


def kept_analyses() -> "Kept":
    """Analyses of this user's earlier commands."""
    from service.jobs.kept import kept_by_user

    return kept_by_user(current_settings().jobs.kept_room)


def description_digest(building: Path) -> str:
    """Digest of a building file with the files that it names."""
    from service.buildings.description import stored

    return sha256(stored(read_text(building)).encode()).hexdigest()


def say_kept(kept: "Kept") -> None:
    """Say on standard error how many analyses were taken from those that are kept."""
    if kept.found:
        analyses = "1 analysis was" if kept.found == 1 else f"{kept.found} analyses were"
        typer.echo(f"{analyses} kept by an earlier command in {kept.folder}", err=True)


def read_usable_records(
    model: Path,
    files: list[Path],
    building: Path,
    report_step: "ReportStep",
    held_out: Sequence[Path] = (),
    integral: "Integral | None" = None,
    usual: "Integral | None" = None,
) -> tuple["ModelFile", "Earthquakes"]:
    """The same; the command ends with the reasons if no record is usable."""
    read, records = read_records(model, files, building, report_step, held_out, integral, usual)
    if not records.observations:
        end_without_records(records)
    return read, records


def end_without_records(records: "Earthquakes") -> NoReturn:
    """End the command with the reasons why no record is usable."""
    end("\n".join(records.unused) or "none of the files contains records", REFUSED)


@contextmanager
def refusals() -> Iterator[None]:
    """End the command with the reason if the files or the computation are refused."""
    from core.errors import CoreError
    from service.formats import FormatError

    try:
        yield
    except (CoreError, FormatError) as error:
        end(str(error), REFUSED)


def write_text(text: str, path: Path) -> None:
    """Write a text file; its folder is made if it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def write_json(document: dict[str, object], path: Path) -> None:
    """Write indented JSON."""
    import orjson

    write_text(orjson.dumps(document, option=orjson.OPT_INDENT_2 | orjson.OPT_APPEND_NEWLINE).decode(), path)


@contextmanager
def progress_bar() -> Iterator["ReportStep"]:
    """A progress bar on a terminal, which disappears at the end; none where the output goes into a file."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("")

        def report_step(doing: str, done: int, of: int) -> None:
            progress.update(task, description=doing, completed=done, total=of)

        yield report_step
