"""The reproduction: tables and remarks on a terminal and as Markdown, with figures as one self-contained HTML file."""

from collections.abc import Iterable
from dataclasses import dataclass

from altair import LayerChart
from markupsafe import Markup
from rich.console import Group, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from service.reports.html import rendered, svg
from service.reproduction.drawing import Figure
from service.reproduction.real import RealBuilding
from service.reproduction.real_figures import real_figures
from service.reproduction.real_tables import amplitude_tables, real_tables
from service.reproduction.remarks import real_remarks, simulated_remarks
from service.reproduction.simulated import Simulated
from service.reproduction.simulated_figures import force_figures, response_figures
from service.reproduction.simulated_tables import simulated_tables
from service.reproduction.table import Table

OPENING = (
    'Every number that sections 7 and 8 print of "Using component mode synthesis to estimate the restoring force of '
    'an isolation layer subjected to earthquakes" (John Wiley & Sons, 2008), beside what comes out here, by every '
    "estimator there is; cms is the paper's own. Where the two differ the text says so; nothing was tuned to meet "
    "the paper."
)
WITHOUT_RECORDS = (
    "Section 8 is left out: no records of a real building were given. "
    "The command menshin reproduce FILE... --building FILE takes them."
)


@dataclass(frozen=True, slots=True)
class Section:
    """One section of the paper."""

    title: str
    tables: tuple[Table, ...]
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Report:
    """All of it."""

    sections: tuple[Section, ...]
    opening: str = OPENING


def report(simulated: Simulated, real: RealBuilding | None) -> Report:
    """Section 7, and section 8 where there are records."""
    seven = Section("Section 7. Numerical simulation", simulated_tables(simulated), simulated_remarks(simulated))
    title = "Section 8. Application to an actual base-isolated building"
    if real is None:
        return Report((seven, Section(title, (), (WITHOUT_RECORDS,))))
    return Report((seven, Section(title, (*real_tables(real), *amplitude_tables(real)), real_remarks(real))))


def on_terminal(report: Report) -> RenderableType:
    """Every section with its tables and remarks."""
    return Group(*(part for section in report.sections for part in _section(section)))


def _section(section: Section) -> list[RenderableType]:
    remarks = [Text(f"\n{remark}") for remark in section.remarks]
    return [Text(f"\n{section.title}", style="bold"), *map(_rich, section.tables), *remarks]


def _rich(table: Table) -> RichTable:
    drawn = RichTable(title=f"\n{table.title}", title_justify="left", caption=table.note, caption_justify="left")
    for index, heading in enumerate(table.columns):
        drawn.add_column(Text(heading), justify="left" if index < table.numbers_from else "right")
    for row in table.rows:
        drawn.add_row(*map(Text, row))
    return drawn


def as_markdown(report: Report, command: str) -> str:
    """The same as a document, with the command that printed it."""
    opening = ["# The paper, reproduced", report.opening, "Printed by", f"    {command}"]
    parts = [part for section in report.sections for part in _markdown(section)]
    return "\n\n".join([*opening, *parts]) + "\n"


def _markdown(section: Section) -> list[str]:
    remarks = "\n".join(f"- {remark}" for remark in section.remarks)
    tables = [part for table in section.tables for part in (f"### {table.title}", _rows(table), table.note)]
    return [part for part in (f"## {section.title}", *tables, remarks) if part]


def _rows(table: Table) -> str:
    rule = ["---" if index < table.numbers_from else "---:" for index in range(len(table.columns))]
    return "\n".join(f"| {' | '.join(row)} |" for row in (table.columns, rule, *table.rows))


def page(report: Report, simulated: Simulated, real: RealBuilding | None) -> str:
    """Tables, remarks and figures."""
    figures = ((*response_figures(simulated), *force_figures(simulated)), () if real is None else real_figures(real))
    return rendered(
        "service.reproduction",
        "reproduction.html",
        opening=report.opening,
        sections=[(section, _with_svgs(some)) for section, some in zip(report.sections, figures, strict=True)],
    )


def _with_svgs(figures: Iterable[Figure]) -> list[tuple[Figure, list[Markup]]]:
    return [
        (figure, [_panel(figure.number, number, panel) for number, panel in enumerate(figure.panels)])
        for figure in figures
    ]


def _panel(figure: int, number: int, panel: LayerChart) -> Markup:
    return svg(panel, f"figure-{figure}-{number}", f"Figure {figure}, panel {number + 1}")
