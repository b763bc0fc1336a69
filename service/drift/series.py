"""Monitored series of a building, read from its stored results; `core.drift.from_analyses` makes them of the rows.

All are from the latest analysis of each event, the earliest event first: when an event arrived or how often it was
analysed makes no difference.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from datetime import datetime
from itertools import chain
from types import MappingProxyType

import numpy as np
from sqlalchemy.orm import Session

from core.comparison.misfit import Misfit
from core.drift.from_analyses import (
    AnalysedEvent,
    IdentifiedMode,
    Named,
    measurement,
    measurements_of_modes,
    measurements_of_sensor,
    series_of,
)
from core.drift.quantities import QUANTITIES, SENSOR_QUANTITIES
from core.drift.series import MeasurementColumns, Series
from core.sensors.sensor_errors import SensorHealth
from service.analyses import history, mode_tracks
from service.analyses.mode_tracks import DIRECTIONS
from service.db.select import Span
from service.models import queries as model_queries

Temperatures = Mapping[int, float]
"""°C, by event; only events with a thermometer."""
Events = Collection[int] | None
"""Numbers of events; None: all."""
Reader = Callable[[Session, int, Temperatures, Events], Iterator[Named]]


def monitored_series(
    session: Session,
    building_id: int,
    quantities: Collection[str] = QUANTITIES.keys(),
    events: Events = None,
) -> tuple[Series, ...]:
    """Every series of a building, or those of some quantities, by quantity and subject.

    `model_error` is of a direction; the subjects of the others are those of `core.drift.from_analyses.drift_series`.

    Args:
        session: of the database.
        building_id: number of the building.
        quantities: names in core.drift.quantities.
        events: numbers of the events whose measurements are enough; frequencies and model errors are of all events even
            so.
    """
    temperatures = dict(history.temperatures(session, building_id, events))
    named = chain.from_iterable(
        read(session, building_id, temperatures, events)
        for read, provided in READERS.items()
        if not provided.isdisjoint(quantities)
    )
    found = list(series_of(named))
    if not CYCLE_QUANTITIES.isdisjoint(quantities):
        found += _cycles(session, building_id, temperatures, events)
    ordered = sorted(found, key=lambda one: (one.quantity, one.subject))
    return tuple(one for one in ordered if one.quantity in quantities)


def _event(number: int, start: datetime, temperatures: Temperatures) -> AnalysedEvent:
    return AnalysedEvent(number, start, temperatures.get(number))


def _cycles(session: Session, building_id: int, temperatures: Temperatures, only: Events) -> Iterator[Series]:
    """Stiffness and damping of the layer in each direction: of every cycle, at its middle and its amplitude."""
    results, rows = history.directions(session, building_id, only), history.all_cycles(session, building_id, only)
    if not rows:
        return
    result, number, start, end, amplitude, k_eq, k_eq_std, c_eq, c_eq_std = map(np.array, zip(*rows, strict=True))
    numbers = np.array([one.result for one in results])
    by_number = np.argsort(numbers)
    place = by_number[np.searchsorted(numbers, result, sorter=by_number)]
    event, direction = (np.array([getattr(one, name) for one in results])[place] for name in ("event", "direction"))
    time = np.array([one.record_start.timestamp() for one in results])[place] + (start + end) / 2
    temperature = np.array([temperatures.get(one.event, np.nan) for one in results])[place]
    order = np.lexsort((number, place))
    for quantity, value, std in (("stiffness", k_eq, k_eq_std), ("damping", c_eq, c_eq_std)):
        known = order[np.isfinite(value[order]) & np.isfinite(std[order])]
        columns = MeasurementColumns(event, np.round(time, 6), value, std, amplitude, temperature)
        for subject in sorted(set(direction[known].tolist())):
            yield Series(quantity, subject, columns.subset(known[direction[known] == subject]))


def _residuals(session: Session, building_id: int, temperatures: Temperatures, events: Events) -> Iterator[Named]:
    for row in history.residuals(session, building_id, events):
        event = _event(row.event, row.event_start, temperatures)
        yield from measurement("residual_displacement", row.direction, event, row.value, row.std)


def _sensors(session: Session, building_id: int, temperatures: Temperatures, events: Events) -> Iterator[Named]:
    for row in history.sensors(session, building_id, events):
        event = _event(row.event, row.event_start, temperatures)
        yield from measurements_of_sensor(event, SensorHealth(row.channel, row.noise, row.gain, row.gain_std))


def _frequencies(session: Session, building_id: int, temperatures: Temperatures, _: Events) -> Iterator[Named]:
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


def _model_errors(session: Session, building_id: int, temperatures: Temperatures, _: Events) -> Iterator[Named]:
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
