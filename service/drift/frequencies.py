"""Natural frequencies as monitored: modes followed from event to event, on from where they were followed before."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import chain, groupby, pairwise

import numpy as np
from sqlalchemy.orm import Session

from core.arrays import Indices, Mask, Matrix, Vector
from core.drift.series import MeasurementColumns, Series
from core.identification.modes import Mode
from core.identification.tracking import tracks
from service.analyses import history
from service.analyses.mode_tracks import EVENTS
from service.db.select import Line


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Modes of one direction as n sightings in the latest events, in order of time, all at the same levels."""

    levels: tuple[str, ...]
    event: Indices
    """(n,) numbers of the events."""
    start: Vector
    """(n,) s since 1970-01-01 UTC."""
    peak_force: Vector
    """(n,) N."""
    frequency: Vector
    """(n,) Hz."""
    frequency_std: Vector
    """(n,) Hz; NaN where it is not known."""
    shape: Matrix
    """(n, levels)"""
    track: Indices
    """(n,) number of the track, the lowest median frequency first."""
    is_established: Mask
    """(n,) whether the track is a mode of the building."""

    def subset(self, which: Mask | Indices) -> "Sightings":
        """The sightings selected by a mask or by indices."""
        return Sightings(self.levels, *(getattr(self, one.name)[which] for one in fields(self)[1:]))

    def joined(self, other: "Sightings") -> "Sightings":
        """The sightings of both, in order of time."""
        both = (np.concatenate([getattr(self, one.name), getattr(other, one.name)]) for one in fields(self)[1:])
        every = Sightings(self.levels, *both)
        return every.subset(np.lexsort((every.event, every.start)))


def followed(
    session: Session, building_id: int, direction: str, before: Sightings | None, changed: Collection[int]
) -> Sightings:
    """Modes of a direction with their tracks.

    Args:
        session: to read with.
        building_id: of the building.
        direction: name of the direction.
        before: as they were followed last; None where that is not known.
        changed: numbers of the events that were analysed since then, or are gone.
    """
    if before is not None and before.event.size and before.event[-1] not in changed:
        kept = before.subset(~np.isin(before.event, list(changed)))
        rows = history.modes_of_direction(session, building_id, direction, changed, EVENTS)
        every = kept.joined(_sightings(rows, before.levels))
        is_last_alike = (
            not rows or every.event[-1] == rows[-1].event or rows[-1].event_start.timestamp() < kept.start[-1]
        )
        if is_last_alike and np.unique(every.event).size <= EVENTS:
            return _tracked(every, _first_changed(every, before, changed))
    rows = history.modes_of_direction(session, building_id, direction, None, EVENTS)
    levels = tuple(next(one.shape for one in rows if one.event == rows[-1].event)) if rows else ()
    return _tracked(_sightings(rows, levels), 0)


def frequencies(direction: str, sightings: Sightings, temperatures: Mapping[int, float]) -> Iterator[Series]:
    """The frequency of each established mode, each at the peak force of its event.

    Args:
        direction: name of the direction.
        sightings: its modes.
        temperatures: °C, by event.
    """
    for number, track in enumerate(np.unique(sightings.track[sightings.is_established]).tolist(), start=1):
        own = sightings.subset(sightings.track == track)
        columns = MeasurementColumns(
            event=own.event,
            time=own.start,
            value=own.frequency,
            std=np.nan_to_num(own.frequency_std),
            amplitude=own.peak_force,
            temperature=np.array([temperatures.get(event, np.nan) for event in own.event.tolist()]),
        )
        yield Series("frequency", f"{direction}/{number}", columns)


def _sightings(rows: Sequence[Line], levels: tuple[str, ...]) -> Sightings:
    """Rows as sightings, without those at other levels."""
    alike = [one for one in rows if set(one.shape) == set(levels)]
    number = np.arange(len(alike))
    return Sightings(
        levels=levels,
        event=np.array([one.event for one in alike], dtype=np.intp),
        start=np.array([one.event_start.timestamp() for one in alike], dtype=float),
        peak_force=np.array([one.peak_force for one in alike], dtype=float),
        frequency=np.array([one.frequency for one in alike], dtype=float),
        frequency_std=np.array([one.frequency_std for one in alike], dtype=float),
        shape=np.array([[one.shape[level] for level in levels] for one in alike], dtype=float).reshape(
            number.size, len(levels)
        ),
        track=np.full(number.size, -1, dtype=np.intp),  # not followed yet
        is_established=np.zeros(number.size, dtype=bool),
    )


def _modes(sightings: Sightings) -> list[list[Mode]]:
    """The modes of each event."""
    std = [None if np.isnan(one) else one for one in sightings.frequency_std.tolist()]
    made = [
        Mode(frequency, np.nan, shape, error)
        for frequency, shape, error in zip(sightings.frequency.tolist(), sightings.shape, std, strict=True)
    ]
    return [[made[n] for n, _ in own] for _, own in groupby(enumerate(sightings.event.tolist()), lambda one: one[1])]


def _tracked(sightings: Sightings, known: int) -> Sightings:
    """Sightings with their tracks, of which those of the first `known` ones are what they were."""
    modes = _modes(sightings)
    sizes = np.cumsum([0, *map(len, modes)])
    first = int(np.searchsorted(sizes, known))
    numbers = np.unique(sightings.track[:known], return_inverse=True)[1]
    found = tracks(modes, [numbers[begin:end].tolist() for begin, end in pairwise(sizes[: first + 1])])
    place = {id(mode): n for n, mode in enumerate(chain.from_iterable(modes))}
    track, is_established = np.empty(len(place), dtype=np.intp), np.empty(len(place), dtype=bool)
    for number, one in enumerate(found):
        own = [place[id(mode)] for mode in one.modes]
        track[own], is_established[own] = number, one.is_established
    return replace(sightings, track=track, is_established=is_established)


def _first_changed(every: Sightings, before: Sightings, changed: Collection[int]) -> int:
    """Number of the first sightings that were followed before after the same earlier ones."""
    own, other = (np.flatnonzero(np.isin(one.event, list(changed))) for one in (every, before))
    return min(own[0] if own.size else every.event.size, other[0] if other.size else before.event.size)
