"""What the workbench found, as one HTML file that needs nothing else: neither a network nor a script."""

from core.workbench.comparing import ComparisonResult, force_table, levels_of, prediction_table
from core.workbench.tables import values_of
from service.models.workbench.figure import Figure
from service.models.workbench.figures.corrections import stiffness_over_amplitude, yield_over_travel
from service.models.workbench.figures.histories import histories, loop, strongest_of
from service.models.workbench.figures.profiles import shares
from service.models.workbench.figures.residual import over_motion, spectrum
from service.models.workbench.work import Work
from service.reports.html import rendered, svg

PACKAGE = "service.models.workbench"
"""Whose folder `templates` has the workbench's."""


def page(found: Work[ComparisonResult]) -> str:
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
    """Those that need no candidates."""
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
