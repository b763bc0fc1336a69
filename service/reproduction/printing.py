"""The tables for a terminal, and for a Markdown document."""

from rich.console import Group, RenderableType
from rich.table import Table as RichTable
from rich.text import Text

from service.reproduction.report import Report, Section
from service.reproduction.table import Table


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
