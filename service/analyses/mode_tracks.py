"""A building's modes, followed from event to event."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import groupby

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from core.identification.modes import Mode
from core.identification.tracking import Track, tracks
from service.analyses.tables import Analysis, DirectionResult, ModeResult
from service.db.select import Line, Span
from service.records.tables import Event

EVENTS = 1000
"""Number of the latest events that are followed."""
SHOWN = 100
"""Number of the latest events that a page shows."""
DIRECTIONS = ("x", "y")


@dataclass(frozen=True, slots=True, eq=False)
class Sighting:
    """A mode in one event, and how strong the event was."""

    event: int
    event_start: datetime
    pga: float | None
    """m/s², of the ground."""
    peak_force: float
    """N, of the isolation layer: the shear at the superstructure's foot and the slab's inertia."""
    peak_displacement: float | None
    """m, of the isolation layer."""
    mode: Mode
    levels: tuple[str, ...]
    """Levels of the mode's shape."""


@dataclass(frozen=True, slots=True, eq=False)
class TrackedMode:
    """One mode of the building over its events."""

    direction: str
    number: int
    """From 1 in each direction, the lowest frequency first."""
    is_established: bool
    """True if it was identified often enough to be a mode of the building."""
    sightings: tuple[Sighting, ...]
    """The earliest first."""

    @property
    def frequency(self) -> float:
        """Hz, the median."""
        return float(np.median([sighting.mode.frequency for sighting in self.sightings]))

    @property
    def damping_ratio(self) -> float:
        """The median."""
        return float(np.median([sighting.mode.damping_ratio for sighting in self.sightings]))


def tracked_modes(
    session: Session, building_id: int, span: Span, direction: str, most: int = EVENTS
) -> tuple[TrackedMode, ...]:
    """The modes of a building in one direction, by the latest analysis of each of the latest events.

    Shapes are compared at the levels of the latest event; events with other levels are ignored.
    """
    rows_of_all = _rows(session, building_id, span, direction, most)
    events = [list(rows) for _, rows in groupby(rows_of_all, lambda row: row.id)]
    levels = tuple(events[-1][0].ModeResult.shape) if events else ()
    events = [rows for rows in events if set(rows[0].ModeResult.shape) == set(levels)]
    seen = [[_sighting(row, levels) for row in rows] for rows in events]
    tracked = tracks([[sighting.mode for sighting in sightings] for sightings in seen])
    return tuple(_tracked(direction, number, track, seen) for number, track in enumerate(tracked, start=1))


def _rows(session: Session, building_id: int, span: Span, direction: str, most: int) -> Sequence[Line]:
    """A row for each mode of the latest events that have any, the earliest first."""
    with_modes = (
        select(Event.id, Event.start, Analysis.pga, DirectionResult)
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .where(Event.building_id == building_id, DirectionResult.direction == direction, DirectionResult.modes.any())
    )
    latest = span.limit(with_modes).order_by(Event.start.desc(), Event.id.desc()).limit(most)
    of_event = latest.with_only_columns(
        Event.id,
        Event.start,
        Analysis.pga,
        DirectionResult.id.label("result"),
        DirectionResult.peak_force,
        DirectionResult.peak_displacement,
    ).subquery()
    query = select(of_event, ModeResult).join(ModeResult, ModeResult.result_id == of_event.c.result)
    return session.execute(query.order_by(of_event.c.start, of_event.c.id, ModeResult.number)).all()


def _sighting(row: Line, levels: tuple[str, ...]) -> Sighting:
    stored = row.ModeResult
    mode = Mode(
        frequency=stored.frequency,
        damping_ratio=stored.damping_ratio,
        shape=np.array([stored.shape[level] for level in levels]),
        frequency_std=stored.frequency_std,
        damping_ratio_std=stored.damping_ratio_std,
        shape_std=None if stored.shape_std is None else np.array([stored.shape_std[level] for level in levels]),
        misfit=stored.misfit,
    )
    return Sighting(row.id, row.start, row.pga, row.peak_force, row.peak_displacement, mode, levels)


def _tracked(direction: str, number: int, track: Track, seen: Sequence[Sequence[Sighting]]) -> TrackedMode:
    by_mode = {id(sighting.mode): sighting for event in track.events for sighting in seen[event]}
    return TrackedMode(direction, number, track.is_established, tuple(by_mode[id(mode)] for mode in track.modes))
