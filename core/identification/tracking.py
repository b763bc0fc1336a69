"""Which identified modes of different events are one and the same?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from core.arrays import Matrix, Vector
from core.identification.modes import Mode

CHANGES = 0.04
"""Relative standard deviation of a mode's frequency from one event to another: stronger shaking softens a building."""
TURNS = 0.1
"""One less the modal assurance criterion that makes a difference of one standard deviation."""
GATE = 3.0
"""Standard deviations beyond which two modes are not the same."""
MEMORY = 5
"""Events that tell where a mode is to be expected: the latest in which it was seen."""
ENOUGH = 3
"""Events that make a mode one of the building rather than of a record."""
OFTEN = 1 / 3
"""Share of the events since its first in which it is then seen at least."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """One mode over the events in which it was identified."""

    events: tuple[int, ...]
    """Rising, indices of the events."""
    modes: tuple[Mode, ...]
    """One for each of these events."""
    is_established: bool
    """Whether it was seen often enough to be one of the building."""


def tracks(events: Sequence[Sequence[Mode]]) -> tuple[Track, ...]:
    """Modes of the same shape at about the same frequency, event after event.

    In each event the modes are given to the tracks so far, or to new ones, at the least sum of squared distances
    (Kuhn 1955). A track outlives events in which its mode was not found; a mode that fits none begins one.

    Args:
        events: the modes of each event, in order of time; all shapes at the same floors.

    Returns:
        Every track, the lowest median frequency first.
    """
    members: list[list[tuple[int, Mode]]] = []
    for event, modes in enumerate(events):
        expected = [[mode for _, mode in track[-MEMORY:]] for track in members]
        for mode, place in zip(modes, _assigned(modes, expected), strict=True):
            if place is None:
                members.append([(event, mode)])
            else:
                members[place].append((event, mode))
    found = [_track(track, len(events)) for track in members]
    return tuple(sorted(found, key=lambda track: float(np.median([mode.frequency for mode in track.modes]))))


def _track(members: Sequence[tuple[int, Mode]], events: int) -> Track:
    indices, modes = zip(*members, strict=True)
    since = events - indices[0]
    is_established = len(modes) >= min(ENOUGH, events) and len(modes) >= OFTEN * since
    return Track(indices, modes, is_established)


def _assigned(modes: Sequence[Mode], expected: Sequence[Sequence[Mode]]) -> list[int | None]:
    """Of each mode the track it belongs to; None for one that belongs to none."""
    if not modes:
        return []
    squares = np.array([[_square(mode, track) for track in expected] for mode in modes]).reshape(len(modes), -1)
    # Every mode may also begin a track of its own, at the cost of the farthest that would still be the same.
    alone = np.where(np.eye(len(modes), dtype=bool), GATE**2, np.inf)
    rows, columns = optimize.linear_sum_assignment(np.hstack([np.where(squares < GATE**2, squares, np.inf), alone]))
    places: list[int | None] = [None] * len(modes)
    for row, column in zip(rows, columns, strict=True):
        places[row] = int(column) if column < len(expected) else None
    return places


def _square(mode: Mode, latest: Sequence[Mode]) -> float:
    """Squared distance of a mode from those a track saw last, in standard deviations."""
    frequency = float(np.median([other.frequency for other in latest]))
    variances = [_variance(other) for other in (mode, *latest)]
    variance = variances[0] + float(np.median(variances[1:])) + (CHANGES * frequency) ** 2
    turned = 1 - _assurance(mode.shape, np.array([other.shape for other in latest]))
    return (mode.frequency - frequency) ** 2 / variance + (turned / TURNS) ** 2


def _variance(mode: Mode) -> float:
    return 0.0 if mode.frequency_std is None else mode.frequency_std**2


def _assurance(shape: Vector, others: Matrix) -> float:
    """The median modal assurance criterion, Allemang and Brown (1982)."""
    lengths = np.sum(shape**2) * np.sum(others**2, axis=1)
    return float(np.median((others @ shape) ** 2 / lengths))
