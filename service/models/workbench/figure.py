"""A picture of the workbench, and the numbers it is drawn from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import altair as alt

Rows = list[dict[str, Any]]
SHOWN = 400
"""Rows of a table: of a longer one every second, third ... is shown."""
WIDTH = 860
"""Pixels, of a picture over the whole page."""
MEASURED, MODEL = "measured", "model"
INK, FAINT = "#1c2430", "#5b6675"


@dataclass(frozen=True, slots=True, eq=False)
class NumberTable:
    """Numbers for those who do not see a picture, or want to have them."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    is_thinned: bool


@dataclass(frozen=True, slots=True, eq=False)
class Figure:
    """One picture."""

    key: str
    """A word for addresses and ids."""
    title: str
    caption: str
    """Caption: the contents, and signs to look for."""
    picture: alt.TopLevelMixin
    numbers: NumberTable


def table(rows: Sequence[dict[str, Any]]) -> NumberTable:
    """Rows of alike keys as a table, to four digits."""
    step = max(1, -(-len(rows) // SHOWN))
    columns = tuple(rows[0]) if rows else ()
    return NumberTable(columns, tuple(tuple(_cell(row[c]) for c in columns) for row in rows[::step]), step > 1)


def values(rows: Rows) -> alt.InlineData:
    """Rows as a picture takes them."""
    return alt.InlineData(values=rows)


def curves(colours: Mapping[str, str]) -> alt.Color:
    """A colour for each `curve`, named above the picture."""
    scale = alt.Scale(domain=list(colours), range=list(colours.values()))
    legend = alt.Legend(title=None, orient="top", symbolType="stroke", symbolStrokeWidth=3)
    return alt.Color("curve:N", scale=scale, legend=legend)


def _cell(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
