"""One table of the report, as Markdown, and the place of tables in a page."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Table:
    """A measurement with remarks."""

    title: str
    about: str
    """Procedure, above the table."""
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    remark: str = ""
    """Interpretation, below the table."""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise ValueError(f"{self.title}: the row {row} does not fit the columns {self.columns}")

    def markdown(self) -> str:
        """Heading, text and table."""
        lines = [self.columns, tuple("---" for _ in self.columns), *self.rows]
        grid = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        return "\n\n".join(part for part in (f"### {self.title}", self.about, grid, self.remark) if part) + "\n"


def with_results(page: str, program: str, text: str) -> str:
    """A page with a text in place of what a program wrote into it before, between two comments that name the program.

    Raises:
        ValueError: the page does not have them once each.
    """
    begin, end = (f"<!-- {edge} of what `python -m {program}` writes -->" for edge in ("begin", "end"))
    before, rest = page.split(begin)
    _, after = rest.split(end)
    return f"{before}{begin}\n\n{text}\n{end}{after}"
