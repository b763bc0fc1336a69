"""Figures of comparisons and diagnoses."""

from core.workbench.comparing import ComparisonResult
from core.workbench.diagnosis_result import DiagnosisResult
from service.documents.document import Figure
from service.models.figures.corrections import candidates, stiffness_over_amplitude, yield_over_travel
from service.models.figures.histories import histories, loop, strongest_of
from service.models.figures.residual import over_motion, shares, spectrum


def comparison_figures(result: ComparisonResult) -> list[Figure]:
    """Figures that need no candidates."""
    strongest = strongest_of(result.errors.forces)
    shown = result.errors.of([strongest[0].observation.name])
    drawn = (
        stiffness_over_amplitude(result.corrections),
        loop(strongest),
        over_motion(result.errors.forces),
        yield_over_travel(result.corrections),
        None if result.failure.is_noise else shares(result.failure.profiles),
        spectrum(result.errors.forces),
        histories(shown.forces, shown.predictions),
    )
    return [figure for figure in drawn if figure is not None]


def diagnosis_figures(result: DiagnosisResult) -> list[Figure]:
    """Figures of the refitted model's residual; spectrum and histories also with the added effects."""
    before = result.refitted.errors.forces
    after = result.versions[-1].errors if result.diagnosis.named else None
    strongest = strongest_of(before)
    last = (after or result.versions[1].errors).of([strongest[0].observation.name])
    drawn = (
        stiffness_over_amplitude(result.refitted.corrections),
        loop(strongest),
        over_motion(before),
        yield_over_travel(result.refitted.corrections),
        candidates(result.candidates, result.diagnosis.first.noise_ratio(result.diagnosis.refitted)),
        spectrum(before, after.forces if after else ()),
        histories(last.forces, last.predictions),
    )
    return [figure for figure in drawn if figure is not None]
