"""A table of the reproduction: text in cells, for terminal, Markdown and page."""

from collections.abc import Mapping
from dataclasses import dataclass

from core.estimators import ESTIMATORS

NONE = "–"
"""Placeholder for a number that does not exist."""


@dataclass(frozen=True, slots=True)
class Table:
    """Printed beside computed."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers_from: int = 1
    """Index of the first column that holds numbers."""
    note: str = ""


def ours() -> tuple[str, ...]:
    """Headings of the columns with what each estimator finds."""
    return tuple(f"ours, {name}" for name in ESTIMATORS)


def by_estimator(found: Mapping[str, str]) -> tuple[str, ...]:
    """The cells under `ours`."""
    return tuple(found.get(name, NONE) for name in ESTIMATORS)


def with_noise(level: float) -> str:
    """Noise level for display."""
    return f"{100 * level:.0f} % noise"


def with_std(value: float, std: float | None, decimals: int) -> str:
    """A value, and its standard deviation where it has one."""
    return f"{value:.{decimals}f}" if std is None else f"{value:.{decimals}f} ± {std:.{decimals}f}"
