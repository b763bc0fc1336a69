"""A diagnosis as one HTML file: the text, the tables, and the pictures that expose effects."""

from service.models.workbench.candidates_table import candidates_table
from service.models.workbench.diagnosing import Diagnosed
from service.models.workbench.diagnosis_words import words
from service.models.workbench.figure import Figure
from service.models.workbench.figures.candidates import candidates
from service.models.workbench.figures.corrections import stiffness_over_amplitude, yield_over_travel
from service.models.workbench.figures.histories import histories, loop, strongest_of
from service.models.workbench.figures.residual import over_motion, spectrum
from service.models.workbench.page import rendered
from service.models.workbench.values import values_of
from service.models.workbench.versions import tables
from service.reports.svg import svg


def page(found: Diagnosed) -> str:
    """Text, tables and pictures."""
    return rendered(
        "diagnosis.html",
        found=found,
        text=words(found),
        tables=[*tables(found.versions, found.records), candidates_table(found, found.candidates)],
        values=list(values_of(found.model)),
        figures=[(figure, svg(figure.picture, figure.key, figure.title)) for figure in figures(found)],
    )


def figures(found: Diagnosed) -> list[Figure]:
    """Of the refitted model, what it leaves; with what was added, the spectrum and the histories."""
    before = found.refitted.answers.forces
    after = found.versions[-1].answers if found.diagnosis.steps else None
    strongest = strongest_of(before)
    last = found.versions[-1].answers.of([strongest[0].observation.name])
    drawn = (
        stiffness_over_amplitude(found.refitted.corrections),
        loop(strongest),
        over_motion(before),
        yield_over_travel(found.refitted.corrections),
        candidates(found.candidates, found.diagnosis.first.over_floor(found.diagnosis.refitted)),
        spectrum(before, found.records.band, after.forces if after else ()),
        histories(last.forces, last.predictions),
    )
    return [figure for figure in drawn if figure is not None]
