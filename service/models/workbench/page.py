"""Comparisons and diagnoses as one HTML file that needs nothing else: neither a network nor a script."""

from core.workbench.comparing import ComparisonResult, force_table, levels_of, prediction_table
from core.workbench.diagnosing import DiagnosisResult, candidate_table
from core.workbench.tables import values_of, version_tables
from service.models.workbench.figure import Figure
from service.models.workbench.figures.candidates import candidates
from service.models.workbench.figures.corrections import stiffness_over_amplitude, yield_over_travel
from service.models.workbench.figures.histories import histories, loop, strongest_of
from service.models.workbench.figures.profiles import shares
from service.models.workbench.figures.residual import over_motion, spectrum
from service.models.workbench.work import Work
from service.reports.html import rendered, svg

PACKAGE = "service.models.workbench"
"""Whose folder `templates` has the workbench's."""


def comparison_page(found: Work[ComparisonResult]) -> str:
    """Text, tables and pictures of a comparison."""
    result = found.result
    figures = comparison_figures(result)
    return rendered(
        PACKAGE,
        "comparison.html",
        found=found,
        values=list(values_of(found.model.isolator, found.model.standard_deviations)),
        tables=[table for table in (force_table(result), prediction_table(result, levels_of(result))) if table],
        figures=[(figure, svg(figure.picture, figure.key, figure.title)) for figure in figures],
    )


def comparison_figures(found: ComparisonResult) -> list[Figure]:
    """Figures that need no candidates."""
    strongest = strongest_of(found.errors.forces)
    shown = found.errors.of([strongest[0].observation.name])
    drawn = (
        stiffness_over_amplitude(found.corrections),
        loop(strongest),
        over_motion(found.errors.forces),
        yield_over_travel(found.corrections),
        None if found.failure.is_noise else shares(found.failure.profiles),
        spectrum(found.errors.forces),
        histories(shown.forces, shown.predictions),
    )
    return [figure for figure in drawn if figure is not None]


def diagnosis_page(found: Work[DiagnosisResult]) -> str:
    """Text, tables and pictures."""
    result = found.result
    return rendered(
        PACKAGE,
        "diagnosis.html",
        found=found,
        text=result.text,
        tables=[*version_tables(result.versions, result.earthquakes), candidate_table(result, result.candidates)],
        values=list(values_of(found.model.isolator, found.model.standard_deviations)),
        figures=[(figure, svg(figure.picture, figure.key, figure.title)) for figure in diagnosis_figures(result)],
    )


def diagnosis_figures(found: DiagnosisResult) -> list[Figure]:
    """Figures of the refitted model's residual; spectrum and histories also with the added effects."""
    before = found.refitted.errors.forces
    after = found.versions[-1].errors if found.diagnosis.steps else None
    strongest = strongest_of(before)
    last = found.versions[-1].errors.of([strongest[0].observation.name])
    drawn = (
        stiffness_over_amplitude(found.refitted.corrections),
        loop(strongest),
        over_motion(before),
        yield_over_travel(found.refitted.corrections),
        candidates(found.candidates, found.diagnosis.first.noise_ratio(found.diagnosis.refitted)),
        spectrum(before, after.forces if after else ()),
        histories(last.forces, last.predictions),
    )
    return [figure for figure in drawn if figure is not None]
