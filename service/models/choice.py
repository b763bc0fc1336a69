"""Earthquakes that a diagnosis of a model works with unless a person chooses others."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import numpy as np

MOST = 10
"""Earthquakes at most. The range of their amplitudes matters more than their number. A choice."""
STRONG = 0.3
"""Share of the largest displacement from which on an earthquake is strong enough to test the result on. A choice."""

Use = Literal["fit", "hold_out", "aside"]


@dataclass(frozen=True, slots=True)
class Moved:
    """An earthquake that a model can be compared with."""

    event: int
    start: datetime
    displacement: float
    """m, largest of the layer in the model's directions."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """An earthquake and its use."""

    moved: Moved
    use: Use


def chosen(comparable: Sequence[Moved], event: int) -> tuple[Chosen, ...]:
    """A choice for the diagnosis of a model that missed an earthquake, the latest first.

    That earthquake and the strongest one are fitted, with others of amplitudes as different as there are. The latest
    strong one of the others is held out.

    Args:
        comparable: earthquakes with the layer's motion, in any order.
        event: number of the missed one; it is among them.
    """
    strongest = max(comparable, key=lambda one: one.displacement)
    needed = {event, strongest.event}
    kept = _spread(comparable, needed)
    strong = [one for one in kept if one.displacement >= STRONG * strongest.displacement and one.event not in needed]
    test = max(strong, key=lambda one: one.start, default=None)
    shown = sorted(comparable, key=lambda one: one.start, reverse=True)
    numbers = {one.event for one in kept}
    return tuple(
        Chosen(one, "hold_out" if one is test else "fit" if one.event in numbers else "aside")
        for place, one in enumerate(shown)
        if one.event in numbers or place < MOST
    )


def _spread(comparable: Sequence[Moved], needed: set[int]) -> list[Moved]:
    """The needed ones, and others whose amplitudes are spread as evenly as can be over their logarithm."""
    kept = [one for one in comparable if one.event in needed]
    left = [one for one in comparable if one.event not in needed and one.displacement > 0]
    if len(kept) + len(left) <= MOST:
        return [*kept, *left]
    levels = np.log([one.displacement for one in left])
    for target in np.linspace(levels.max(), levels.min(), MOST - len(kept)):
        nearest = int(np.argmin(np.abs(levels - target)))
        kept.append(left[nearest])
        levels[nearest] = np.inf
    return kept
