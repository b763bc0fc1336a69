"""Mode tracking: identified modes of successive events that are the same mode of the building."""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

import numpy as np
import scipy

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


def tracks(events: Sequence[Sequence[Mode]], known: Sequence[Sequence[int]] = ()) -> tuple[Track, ...]:
    """Tracks of modes with similar shape and frequency from event to event.

    In each event, the modes are assigned to existing or new tracks so that the sum of squared distances is smallest
    (Kuhn 1955). A track continues over events in which its mode was not identified. A mode that matches no track starts
    a new one.

    Args:
        events: the modes of each event, in order of time; all shapes at the same floors.
        known: numbers of the tracks of the modes of the first events, counted from 0, as they were found before; which
            track has which number makes no difference.

    Returns:
        All tracks, lowest median frequency first.
    """
    count = 1 + max((number for numbers in known for number in numbers), default=-1)
    members: list[list[tuple[int, Mode]]] = [[] for _ in range(count)]
    for event, (modes, numbers) in enumerate(zip(events, known, strict=False)):
        for mode, number in zip(modes, numbers, strict=True):
            members[number].append((event, mode))
    expected = [_expected([mode for _, mode in track[-REFERENCE_EVENTS:]]) for track in members]
    for event, modes in enumerate(events[len(known) :], len(known)):
        for mode, place in zip(modes, _assigned(modes, expected), strict=True):
            if place is None:
                members.append([(event, mode)])
                expected.append(_expected([mode]))
            else:
                members[place].append((event, mode))
                expected[place] = _expected([mode for _, mode in members[place][-REFERENCE_EVENTS:]])
    every = [_track(track, len(events)) for track in members]
    return tuple(sorted(every, key=lambda track: float(np.median([mode.frequency for mode in track.modes]))))


def _track(members: Sequence[tuple[int, Mode]], events: int) -> Track:
    indices, modes = zip(*members, strict=True)
    since = events - indices[0]
    is_established = len(modes) >= min(LEAST_EVENTS, events) and len(modes) >= LEAST_SHARE * since
    return Track(indices, modes, is_established)


@dataclass(frozen=True, slots=True, eq=False)
class _Expected:
    """The latest modes of a track, at most REFERENCE_EVENTS."""

    frequency: float
    """Hz, the median."""
    variance: float
    """Hz², the median of the estimates plus the scatter between events."""
    shapes: Matrix
    """(REFERENCE_EVENTS, floors) of length 1; NaN where there are fewer."""
    count: int


def _expected(latest: Sequence[Mode]) -> _Expected:
    frequency = median(mode.frequency for mode in latest)
    shapes = np.full((REFERENCE_EVENTS, latest[0].shape.size), np.nan)
    shapes[: len(latest)] = [_unit(mode.shape) for mode in latest]
    variance = median(map(_variance, latest)) + (FREQUENCY_SCATTER * frequency) ** 2
    return _Expected(frequency, variance, shapes, len(latest))


def _unit(shape: Vector) -> Vector:
    return shape / np.sqrt(shape @ shape)


def _variance(mode: Mode) -> float:
    """Hz², 0 if the standard deviation is unknown."""
    return 0.0 if mode.frequency_std is None else mode.frequency_std**2


def _assigned(modes: Sequence[Mode], expected: Sequence[_Expected]) -> list[int | None]:
    """Index of each mode's track; None for a mode that matches no track."""
    if not modes or not expected:
        return [None] * len(modes)
    squares = _squared_distances(modes, expected)
    # A mode may also start a new track, at the cost of the largest distance that still matches.
    alone = np.where(np.eye(len(modes), dtype=bool), GATE**2, np.inf)
    rows, columns = scipy.optimize.linear_sum_assignment(
        np.hstack([np.where(squares < GATE**2, squares, np.inf), alone])
    )
    places: list[int | None] = [None] * len(modes)
    for row, column in zip(rows, columns, strict=True):
        places[row] = int(column) if column < len(expected) else None
    return places


def _squared_distances(modes: Sequence[Mode], expected: Sequence[_Expected]) -> Matrix:
    """(modes, tracks) squared distances in standard deviations, of frequency and of 1 - the median MAC."""
    frequencies = np.array([track.frequency for track in expected])
    variances = np.array([track.variance for track in expected])
    own = np.array([mode.frequency for mode in modes])[:, None]
    own_variance = np.array([_variance(mode) for mode in modes])[:, None]
    shapes = np.array([_unit(mode.shape) for mode in modes])
    assurance = np.sort(np.einsum("tkf,mf->mtk", np.array([track.shapes for track in expected]), shapes) ** 2)
    counts = np.array([track.count for track in expected])  # NaN stand last
    middle = [
        np.take_along_axis(assurance, place[None, :, None], 2)[..., 0] for place in ((counts - 1) // 2, counts // 2)
    ]
    shape_difference = 1 - 0.5 * (middle[0] + middle[1])
    return np.asarray((own - frequencies) ** 2 / (own_variance + variances) + (shape_difference / SHAPE_SCATTER) ** 2)
