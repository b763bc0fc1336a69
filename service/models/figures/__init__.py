"""Figures of comparisons and diagnoses."""

from core.workbench.comparing import ComparisonResult
from core.workbench.diagnosing import DiagnosisResult
from service.models.figures.corrections import candidates, stiffness_over_amplitude, yield_over_travel
from service.models.figures.histories import histories, loop, strongest_of
from service.models.figures.residual import over_motion, shares, spectrum
from service.reports.document import Figure


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
