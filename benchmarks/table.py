"""One table of the report, as Markdown."""

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
