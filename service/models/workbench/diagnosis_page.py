"""A diagnosis as one HTML file: the text, the tables, and the pictures that expose effects."""

from core.workbench.diagnosing import DiagnosisResult, candidate_table
from core.workbench.tables import values_of, version_tables
from service.models.workbench.figure import Figure
from service.models.workbench.figures.candidates import candidates
from service.models.workbench.figures.corrections import stiffness_over_amplitude, yield_over_travel
from service.models.workbench.figures.histories import histories, loop, strongest_of
from service.models.workbench.figures.residual import over_motion, spectrum
from service.models.workbench.page import PACKAGE
from service.models.workbench.work import Work
from service.reports.html import rendered, svg


def page(found: Work[DiagnosisResult]) -> str:
    """Text, tables and pictures."""
    result = found.result
    return rendered(
        PACKAGE,
        "diagnosis.html",
        found=found,
        text=result.text,
        tables=[*version_tables(result.versions, result.earthquakes), candidate_table(result, result.candidates)],
        values=list(values_of(found.model.isolator, found.model.standard_deviations)),
        figures=[(figure, svg(figure.picture, figure.key, figure.title)) for figure in figures(result)],
    )


def figures(found: DiagnosisResult) -> list[Figure]:
    """Of the refitted model, what it leaves; with what was added, the spectrum and the histories."""
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
