"""The workbench's operations on model files: core conducts them, the file keeps where a model came from."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

from core import workbench
from core.model.isolator import Isolator
from core.workbench.comparing import ComparisonResult
from core.workbench.diagnosing import DiagnosisResult
from core.workbench.earthquakes import Earthquakes
from core.workbench.fitting import FitResult
from core.workbench.improving import ExtensionResult, ImprovementResult
from core.workbench.tables import Deviations
from service.jobs.stages import ReportStep
from service.models.model_file import ModelFile

Result = TypeVar("Result")


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
    found = workbench.fit(given.isolator, earthquakes, progress=report_step)
    return Work(given, made(found.model, found.std, given, parent, earthquakes), found)


def compare(given: ModelFile, earthquakes: Earthquakes, report_step: ReportStep) -> Work[ComparisonResult]:
    """Compare a model with all earthquakes; errors as of `fit`."""
    return Work(given, given, workbench.compare(given.isolator, earthquakes, progress=report_step))


def add(
    effect: str, given: ModelFile, parent: str, earthquakes: Earthquakes, report_step: ReportStep
) -> Work[ExtensionResult]:
    """Add an effect to a model and fit everything anew; arguments and errors as of `fit`."""
    found = workbench.add(effect, given.isolator, earthquakes, progress=report_step)
    return Work(given, made(found.model, found.std, given, parent, earthquakes), found)


def diagnose(
    given: ModelFile,
    parent: str,
    earthquakes: Earthquakes,
    report_step: ReportStep,
    effects: Collection[str] | None = None,
) -> Work[DiagnosisResult]:
    """Try every effect that a model does not have, or those of some names; errors as of `fit`."""
    found = workbench.diagnose(given.isolator, earthquakes, effects=effects, progress=report_step)
    return diagnosis(found, given, parent)


def diagnosis(found: DiagnosisResult, given: ModelFile, parent: str) -> Work[DiagnosisResult]:
    """A diagnosis with the model file that it was made from."""
    return Work(given, made(found.model, found.std, given, parent, found.earthquakes), found)


def improve(
    given: ModelFile,
    parent: str,
    earthquakes: Earthquakes,
    report_step: ReportStep,
    effects: Collection[str] | None = None,
) -> Work[ImprovementResult]:
    """Diagnose and add, by turns; errors as of `fit`."""
    found = workbench.improve(given.isolator, earthquakes, effects=effects, progress=report_step)
    return Work(given, made(found.model, found.std, given, parent, earthquakes), found)


def made(model: Isolator, std: Deviations, given: ModelFile, parent: str, earthquakes: Earthquakes) -> ModelFile:
    """The file of a model that was made from another one."""
    return replace(
        given,
        isolator=model,
        reference=earthquakes.reference,
        parent=parent,
        assumed=(),
        fitted_to=earthquakes.fitted_names,
        standard_deviations=std,
    )
