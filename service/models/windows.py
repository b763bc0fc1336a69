"""The parts of a record in which a model's force is furthest from the estimated one."""

from dataclasses import dataclass

import numpy as np

from core.arrays import Vector

BLOCK = 5.0
"""s, as of the blocks of a comparison."""
SHOWN = 5
"""Parts of a record that are shown. A choice."""


@dataclass(frozen=True, slots=True)
class Window:
    """A part of a record."""

    start: float
    """s after the start of the record."""
    error: float
    """N, RMS of the residual."""
    amplitude: float
    """m, largest displacement of the layer."""
    share: float
    """Share of the squared residual of the whole record."""


def worst_windows(displacement: Vector, measured: Vector, modelled: Vector, rate: float) -> list[Window]:
    """The parts with the largest residual, the largest first.

    Args:
        displacement: (n,) m.
        measured: (n,) N, the estimated force.
        modelled: (n,) N, the model's.
        rate: Hz.
    """
    length = round(BLOCK * rate)
    squares = (measured - modelled) ** 2
    total = float(squares.sum()) or 1.0
    found = [
        Window(
            start=at / rate,
            error=float(np.sqrt(squares[at : at + length].mean())),
            amplitude=float(np.abs(displacement[at : at + length]).max()),
            share=float(squares[at : at + length].sum()) / total,
        )
        for at in range(0, squares.size - length // 2, length)
    ]
    return sorted(found, key=lambda one: -one.error)[:SHOWN]
