"""Monitored series of a building, read from its stored results; `core.drift.from_analyses` makes them of the rows.

All are from the latest analysis of each event, the earliest event first: when an event arrived or how often it was
analysed makes no difference.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from datetime import datetime
from functools import partial
from itertools import chain
from types import MappingProxyType

from sqlalchemy.orm import Session

from core.comparison.misfit import Misfit
from core.drift.from_analyses import (
    AnalysedEvent,
    IdentifiedMode,
    Named,
    measurement,
    measurements_of_cycle,
    measurements_of_modes,
    measurements_of_sensor,
    series_of,
)
from core.drift.quantities import QUANTITIES, SENSOR_QUANTITIES
from core.drift.series import Series
from core.isolation_layer.equivalent import EquivalentSegment
from core.sensors.sensor_errors import SensorHealth
from service.analyses import history, mode_tracks
from service.analyses.mode_tracks import DIRECTIONS
from service.db.select import Span
from service.models import queries as model_queries

Temperatures = Mapping[int, float]
"""°C, by event; only events with a thermometer."""
Reader = Callable[[Session, int, Temperatures], Iterator[Named]]


def monitored_series(
    session: Session,
    building_id: int,
    quantities: Collection[str] = QUANTITIES.keys(),
    event: int | None = None,
) -> tuple[Series, ...]:
    """Every series of a building, or those of some quantities, by quantity and subject.

    `model_error` is of a direction; the subjects of the others are those of `core.drift.from_analyses.drift_series`.

    Args:
        session: of the database.
        building_id: number of the building.
        quantities: names in core.drift.quantities.
        event: number of the event whose cycles are enough; the other quantities are of all events even so.
    """
    temperatures = dict(history.temperatures(session, building_id))
    readers: dict[Reader, frozenset[str]] = {**READERS, partial(_cycles, only=event): CYCLE_QUANTITIES}
    named = chain.from_iterable(
        read(session, building_id, temperatures)
        for read, provided in readers.items()
        if not provided.isdisjoint(quantities)
    )
    return tuple(one for one in series_of(named) if one.quantity in quantities)


def _event(number: int, start: datetime, temperatures: Temperatures) -> AnalysedEvent:
    return AnalysedEvent(number, start, temperatures.get(number))


def _cycles(session: Session, building_id: int, temperatures: Temperatures, only: int | None) -> Iterator[Named]:
    for row in history.all_cycles(session, building_id, only):
        cycle = EquivalentSegment(
            row.start, row.end, row.amplitude, None, row.k_eq, row.k_eq_std, row.c_eq, row.c_eq_std
        )
        event = _event(row.event, row.event_start, temperatures)
        yield from measurements_of_cycle(event, row.direction, row.record_start, cycle)


def _residuals(session: Session, building_id: int, temperatures: Temperatures) -> Iterator[Named]:
    for row in history.residuals(session, building_id):
        event = _event(row.event, row.event_start, temperatures)
        yield from measurement("residual_displacement", row.direction, event, row.value, row.std)


def _sensors(session: Session, building_id: int, temperatures: Temperatures) -> Iterator[Named]:
    for row in history.sensors(session, building_id):
        event = _event(row.event, row.event_start, temperatures)
        yield from measurements_of_sensor(event, SensorHealth(row.channel, row.noise, row.gain, row.gain_std))


def _frequencies(session: Session, building_id: int, temperatures: Temperatures) -> Iterator[Named]:
    for direction in DIRECTIONS:
        tracked = mode_tracks.tracked_modes(session, building_id, Span(), direction)
        established = (
            [
                IdentifiedMode(_event(one.event, one.event_start, temperatures), one.mode, one.peak_force)
                for one in mode.sightings
            ]
            for mode in tracked
            if mode.is_established
        )
        yield from measurements_of_modes(direction, established)


def _model_errors(session: Session, building_id: int, temperatures: Temperatures) -> Iterator[Named]:
    """Errors of the current models over the force, at the peak displacement; without retired models."""
    models = [model.id for model in model_queries.current_versions(session, building_id)]
    compared = model_queries.latest_comparisons(session, models) if models else {}
    peaks = {(row.event, row.direction): row.peak for row in history.peak_displacements(session, building_id)}
    for comparison, event in chain.from_iterable(compared.values()):
        yield from measurement(
            "model_error",
            comparison.direction,
            _event(event.id, event.start, temperatures),
            Misfit(**comparison.misfit).nrmse,
            0.0,
            amplitude=peaks.get((event.id, comparison.direction)),
        )


READERS: Mapping[Reader, frozenset[str]] = MappingProxyType(
    {
        _residuals: frozenset({"residual_displacement"}),
        _sensors: SENSOR_QUANTITIES,
        _frequencies: frozenset({"frequency"}),
        _model_errors: frozenset({"model_error"}),
    }
)
"""Functions that read a building's measurements of all events, with the quantities that they give."""
CYCLE_QUANTITIES = frozenset({"stiffness", "damping"})
"""Quantities that `_cycles` gives."""
