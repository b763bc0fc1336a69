"""Tables of the reproduction: printed beside computed."""

from collections.abc import Mapping

from core.estimators import ESTIMATORS
from core.tables import Table

NONE = "–"
"""Placeholder for a number that does not exist."""


def table(
    caption: str,
    headings: tuple[str, ...],
    rows: tuple[tuple[str, ...], ...],
    *,
    numbers_from: int = 1,
    note: str = "",
) -> Table:
    """A table whose columns hold numbers from an index on."""
    return Table(caption, headings, rows, note, texts=headings[1:numbers_from])


def ours() -> tuple[str, ...]:
    """Headings of the columns of each estimator."""
    return tuple(f"ours, {name}" for name in ESTIMATORS)


def by_estimator(cells: Mapping[str, str]) -> tuple[str, ...]:
    """The cells under `ours`."""
    return tuple(cells.get(name, NONE) for name in ESTIMATORS)


def with_noise(level: float) -> str:
    """Noise level for display."""
    return f"{100 * level:.0f} % noise"


def with_std(value: float, std: float | None, decimals: int) -> str:
    """A value, and its standard deviation where it has one."""
    return f"{value:.{decimals}f}" if std is None else f"{value:.{decimals}f} ± {std:.{decimals}f}"
