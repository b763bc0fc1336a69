"""The reproduction as a report: tables and remarks at a terminal and in Markdown, with figures in an HTML file."""

from dataclasses import dataclass

from core.tables import Table
from service.documents.document import Document, Figure, Part, heading, notes, paragraph, remarks
from service.reproduction.real import RealBuilding
from service.reproduction.real_figures import real_figures
from service.reproduction.real_tables import amplitude_tables, real_remarks, real_tables
from service.reproduction.simulated import Simulated
from service.reproduction.simulated_figures import force_figures, response_figures
from service.reproduction.simulated_tables import simulated_remarks, simulated_tables

TITLE = "The paper, reproduced"
OPENING = (
    'This page compares every number printed in sections 7 and 8 of "Using component mode synthesis to estimate the '
    'restoring force of an isolation layer subjected to earthquakes" (John Wiley & Sons, 2008) with the results of '
    "each estimator here. cms is the paper's own estimator. The remarks say where and why the results differ. Nothing "
    "was tuned to match the paper."
)
WITHOUT_RECORDS = (
    "Section 8 is left out, because no records of a real building were given. "
    "To include it, run menshin reproduce FILE... --building FILE."
)
DRAWINGS = "Figures 1 to 5 and 17 of the paper are drawings without results."


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """One section of the paper."""

    title: str
    tables: tuple[Table, ...]
    remarks: tuple[str, ...]
    figures: tuple[Figure, ...]

    def parts(self) -> tuple[Part, ...]:
        """Its content, in order."""
        return (heading(self.title), *self.tables, remarks(self.remarks), *self.figures)


def sections(simulated: Simulated, real: RealBuilding | None) -> tuple[Section, Section]:
    """Section 7, and section 8 where there are records."""
    seven = Section(
        "Section 7. Numerical simulation",
        simulated_tables(simulated),
        simulated_remarks(simulated),
        (*response_figures(simulated), *force_figures(simulated)),
    )
    title = "Section 8. Application to an actual base-isolated building"
    if real is None:
        return seven, Section(title, (), (WITHOUT_RECORDS,), ())
    tables = (*real_tables(real), *amplitude_tables(real))
    return seven, Section(title, tables, real_remarks(real), real_figures(real))


def summary(sections: tuple[Section, ...]) -> Document:
    """Tables and remarks of every section, for a terminal."""
    return Document("", _parts(sections))


def printed(sections: tuple[Section, ...], command: str) -> Document:
    """The same with an opening and the command that printed it, for Markdown."""
    opening = (paragraph([OPENING]), paragraph(["Printed by"]), paragraph([f"    {command}"]))
    return Document(TITLE, (*opening, *_parts(sections)))


def page(sections: tuple[Section, ...]) -> Document:
    """The same with figures, for an HTML file."""
    return Document(TITLE, (paragraph([OPENING]), notes([DRAWINGS]), *_parts(sections)))


def _parts(sections: tuple[Section, ...]) -> tuple[Part, ...]:
    return tuple(part for section in sections for part in section.parts())
