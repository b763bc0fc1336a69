"""Mode tracking: identified modes of successive events that are the same mode of the building."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize

from core.arrays import Matrix, Vector
from core.identification.modes import Mode

FREQUENCY_SCATTER = 0.04
"""Relative standard deviation of a mode's frequency between events: stronger shaking softens a building."""
SHAPE_SCATTER = 0.1
"""1 - MAC, MAC being the modal assurance criterion, that counts as one standard deviation. A choice."""
GATE = 3.0
"""Distance in standard deviations beyond which two modes are different. A choice."""
REFERENCE_EVENTS = 5
"""Number of a mode's latest events that define its expected frequency and shape. A choice."""
LEAST_EVENTS = 3
"""Events from which a mode belongs to the building rather than to a record. A choice."""
LEAST_SHARE = 1 / 3
"""Smallest share of the events since its first one in which an established mode was identified."""


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """A mode over the events in which it was identified."""

    events: tuple[int, ...]
    """Indices of the events, rising."""
    modes: tuple[Mode, ...]
    """One for each of these events."""
    is_established: bool
    """True if it was identified often enough to be a mode of the building."""


def tracks(events: Sequence[Sequence[Mode]]) -> tuple[Track, ...]:
    """Tracks of modes with similar shape and frequency from event to event.

    In each event, the modes are assigned to existing or new tracks so that the sum of squared distances is smallest
    (Kuhn 1955). A track continues over events in which its mode was not identified. A mode that matches no track starts
    a new one.

    Args:
        events: the modes of each event, in order of time; all shapes at the same floors.

    Returns:
        All tracks, lowest median frequency first.
    """
    members: list[list[tuple[int, Mode]]] = []
    for event, modes in enumerate(events):
        expected = [[mode for _, mode in track[-REFERENCE_EVENTS:]] for track in members]
        for mode, place in zip(modes, _assigned(modes, expected), strict=True):
            if place is None:
                members.append([(event, mode)])
            else:
                members[place].append((event, mode))
    every = [_track(track, len(events)) for track in members]
    return tuple(sorted(every, key=lambda track: float(np.median([mode.frequency for mode in track.modes]))))


def _track(members: Sequence[tuple[int, Mode]], events: int) -> Track:
    indices, modes = zip(*members, strict=True)
    since = events - indices[0]
    is_established = len(modes) >= min(LEAST_EVENTS, events) and len(modes) >= LEAST_SHARE * since
    return Track(indices, modes, is_established)


def _assigned(modes: Sequence[Mode], expected: Sequence[Sequence[Mode]]) -> list[int | None]:
    """Index of each mode's track; None for a mode that matches no track."""
    if not modes:
        return []
    squares = np.array([[_squared_distance(mode, track) for track in expected] for mode in modes]).reshape(
        len(modes), -1
    )
    # A mode may also start a new track, at the cost of the largest distance that still matches.
    alone = np.where(np.eye(len(modes), dtype=bool), GATE**2, np.inf)
    rows, columns = optimize.linear_sum_assignment(np.hstack([np.where(squares < GATE**2, squares, np.inf), alone]))
    places: list[int | None] = [None] * len(modes)
    for row, column in zip(rows, columns, strict=True):
        places[row] = int(column) if column < len(expected) else None
    return places


def _squared_distance(mode: Mode, latest: Sequence[Mode]) -> float:
    """Squared distance of a mode from the latest modes of a track, in standard deviations."""
    frequency = float(np.median([other.frequency for other in latest]))
    variances = [_variance(other) for other in (mode, *latest)]
    variance = variances[0] + float(np.median(variances[1:])) + (FREQUENCY_SCATTER * frequency) ** 2
    shape_difference = 1 - _median_assurance(mode.shape, np.array([other.shape for other in latest]))
    return (mode.frequency - frequency) ** 2 / variance + (shape_difference / SHAPE_SCATTER) ** 2


def _variance(mode: Mode) -> float:
    """Hz², 0 if the standard deviation is unknown."""
    return 0.0 if mode.frequency_std is None else mode.frequency_std**2


def _median_assurance(shape: Vector, others: Matrix) -> float:
    """Median modal assurance criterion between a shape and (modes, floors) others."""
    lengths = np.sum(shape**2) * np.sum(others**2, axis=1)
    return float(np.median((others @ shape) ** 2 / lengths))
