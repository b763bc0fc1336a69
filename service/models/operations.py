"""The workbench on files: records read and analysed, and core's operations with the model files that they make."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Generic, TypeVar

from core import workbench
from core.analysis import AnalysisSettings
from core.description import BuildingDescription
from core.errors import CoreError, RecordError
from core.record import Direction
from core.workbench.comparing import ComparisonResult
from core.workbench.diagnosis_result import DiagnosisResult
from core.workbench.earthquakes import EPOCH, AnalysedEarthquake, Earthquakes, Recording, analysed, joined
from core.workbench.fitting import FitResult
from core.workbench.improving import ExtensionResult, ImprovementResult
from service.analyses.store import kept_analysis
from service.buildings.description import BuildingFile
from service.jobs.kept import Kept
from service.jobs.stages import ReportStep
from service.models import texts
from service.models.model_file import ModelFile
from service.records.event_files import EventFiles, events

Result = TypeVar("Result")
Making = TypeVar("Making", FitResult, ExtensionResult, DiagnosisResult, ImprovementResult)
"""Results that make a model."""


@dataclass(frozen=True, slots=True)
class Reading:
    """Choices for reading records."""

    directions: Sequence[Direction]
    """Directions of the model."""
    reference: datetime | None
    """Instant from which effects count time; None for the start of the first record."""
    settings: AnalysisSettings
    description_sha256: str = ""
    """Digest of the building's description; empty: no analysis is kept."""
    kept: Kept = field(default_factory=Kept)
    """Analyses of earlier commands."""


@dataclass(frozen=True, slots=True, eq=False)
class Work(Generic[Result]):
    """A result of the workbench, with the model files that it came from and made."""

    given: ModelFile
    model: ModelFile
    """The model that was made; of a comparison the given one."""
    result: Result


def fit(given: ModelFile, parent: str, earthquakes: Earthquakes, report_step: ReportStep) -> Work[FitResult]:
    """Fit a model's values to all earthquakes but those held out.

    Args:
        given: the model.
        parent: its name, for the model made from it.
        earthquakes: of the building.
        report_step: called with each step.

    Raises:
        RecordError: no earthquake is left to fit to.
        ModelError: the model's force grew beyond all bounds.
    """
    return work(workbench.fit(given.isolator, earthquakes, progress=report_step), given, parent)


def compare(given: ModelFile, earthquakes: Earthquakes, report_step: ReportStep) -> Work[ComparisonResult]:
    """Compare a model with all earthquakes; errors as of `fit`."""
    return Work(given, given, workbench.compare(given.isolator, earthquakes, progress=report_step))


def add(
    effect: str, given: ModelFile, parent: str, earthquakes: Earthquakes, report_step: ReportStep
) -> Work[ExtensionResult]:
    """Add an effect to a model and fit everything again; arguments and errors as of `fit`."""
    return work(workbench.add(effect, given.isolator, earthquakes, progress=report_step), given, parent)


def diagnose(
    given: ModelFile,
    parent: str,
    earthquakes: Earthquakes,
    report_step: ReportStep,
    effects: Collection[str] | None = None,
    directions: Collection[Direction] | None = None,
) -> Work[DiagnosisResult]:
    """Try every effect that a model does not have, or those of some names, in all directions or in some; errors as of
    `fit`."""
    result = workbench.diagnose(
        given.isolator, earthquakes, effects=effects, directions=directions, progress=report_step
    )
    return work(result, given, parent)


def improve(
    given: ModelFile,
    parent: str,
    earthquakes: Earthquakes,
    report_step: ReportStep,
    effects: Collection[str] | None = None,
) -> Work[ImprovementResult]:
    """Diagnose and add, by turns; errors as of `fit`."""
    result = workbench.improve(given.isolator, earthquakes, effects=effects, progress=report_step)
    return work(result, given, parent)


def work(result: Making, given: ModelFile, parent: str) -> Work[Making]:
    """A result with the model file that it makes from the given one, whose name is `parent`."""
    model = replace(
        given,
        isolator=result.model,
        reference=result.earthquakes.reference,
        parent=parent,
        assumed=(),
        fitted_to=result.earthquakes.fitted_names,
        integral="restored" if result.earthquakes.motion_is_restored else given.integral,
        standard_deviations=result.std,
    )
    return Work(given, model, result)


def records(
    paths: Sequence[Path], held_out: Sequence[Path], building: BuildingFile, reading: Reading, report_step: ReportStep
) -> Earthquakes:
    """Analyse every earthquake in the files.

    Args:
        paths: records, and StationXML.
        held_out: the same, of the held-out earthquakes.
        building: the building.
        reading: choices.
        report_step: called with each step.

    Raises:
        FormatError: a file that cannot be used, or that is not this building's.
        RecordError: a held-out earthquake is also among the others.
    """
    pairs = [(event, False) for event in events(paths, building)]
    pairs += [(event, True) for event in (events(held_out, building) if held_out else ())]
    pairs.sort(key=lambda pair: pair[0].start)
    _check_apart(pairs)
    reference = reading.reference or (pairs[0][0].start if pairs else EPOCH)
    each: list[AnalysedEarthquake] = []
    for number, (event, _) in enumerate(pairs):
        report_step(texts.reading(_name(event)), number, len(pairs))
        each.append(_analysed(event, building.description, reading, reference))
    report_step("read", len(pairs), len(pairs))
    names = [_name(event) for event, is_held_out in pairs if is_held_out]
    return joined(each, building.description, reading.settings.band, reference=reference, held_out=names)


def _name(event: EventFiles) -> str:
    """Name of an earthquake: the start of its record, UTC."""
    return f"{event.start:%Y-%m-%d %H:%M:%S}"


def _check_apart(events: Sequence[tuple[EventFiles, bool]]) -> None:
    for (one, _), (other, _) in pairwise(events):
        if _name(one) == _name(other):
            raise RecordError(texts.held_out_twice(_name(one)))


def _analysed(
    event: EventFiles, description: BuildingDescription, reading: Reading, reference: datetime
) -> AnalysedEarthquake:
    name = _name(event)
    try:
        analysis = kept_analysis(
            event.segments, description, reading.description_sha256, reading.settings, reading.kept
        )
    except CoreError as error:
        return AnalysedEarthquake(name, None, (), str(error))
    recording = Recording(event.segments, description, reading.settings, tuple(reading.directions), reference)
    return analysed(name, analysis, recording)
