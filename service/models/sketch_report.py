"""Sketches as reports, for a terminal and as an HTML file."""

from core.workbench.sketching import SketchResult, dependence_table, missing_table
from core.workbench.tables import values_table, version_tables
from service.models import texts
from service.models.figures.histories import loop, strongest_of
from service.models.figures.residual import over_motion, spectrum
from service.models.figures.sketches import sketch_figures
from service.models.model_file import ModelFile
from service.models.sketch_results import CourseOut
from service.reports.document import Document, Figure, Part, notes, paragraph


def sketch_report(given: ModelFile, result: SketchResult) -> Document:
    """A sketch for a terminal."""
    return Document(texts.SKETCH_TITLE.format(given.building), tuple(_parts(result)))


def sketch_file(given: ModelFile, result: SketchResult) -> Document:
    """A sketch with its figures."""
    return Document(texts.SKETCH_TITLE.format(given.building), (*_parts(result), *_figures(result)))


def _parts(result: SketchResult) -> list[Part]:
    values = [] if result.proposal is None else [values_table(result.proposal.model, result.proposal.std)]
    return [
        paragraph(result.text),
        missing_table(result),
        dependence_table(result),
        *values,
        *version_tables(result.versions, result.earthquakes),
        notes(tuple(result.earthquakes.unused)),
    ]


def _figures(result: SketchResult) -> list[Figure]:
    after = () if result.proposal is None else result.versions[-1].errors.forces
    own = sketch_figures(CourseOut.of(result.course, result.earthquakes.held_out))
    return [*own, loop(strongest_of(result.missing)), over_motion(result.missing), spectrum(result.missing, after)]
