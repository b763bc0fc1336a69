"""Watched series of a building, from its stored results.

All are of the latest analysis of each event, the earliest event first: when an event came in or how often it was
analysed makes no difference.
"""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from datetime import datetime, timedelta
from itertools import chain
from math import isfinite
from types import MappingProxyType

from sqlalchemy.orm import Session

from core.comparison.misfit import Misfit
from core.description import BuildingDescription
from core.drift.quantities import QUANTITIES
from core.drift.series import Measurement, Series
from service.alerts.texts import SENSOR_QUANTITIES
from service.analyses import history, mode_tracks
from service.analyses.mode_tracks import DIRECTIONS, Sighting
from service.db.select import Span
from service.models import queries as model_queries

Named = tuple[tuple[str, str], Measurement]
"""Quantity and subject, and one measurement of them."""


def watched_series(
    session: Session, building_id: int, quantities: Collection[str] = QUANTITIES.keys()
) -> tuple[Series, ...]:
    """Every series of a building, or those of some quantities, by quantity and subject.

    `stiffness`, `damping`, `residual_displacement` and `model_error` are of a direction, `frequency` of a direction's
    established mode (`x/1`), `noise` and `gain` of a channel.
    """
    temperature = dict(history.temperatures(session, building_id))
    found: dict[tuple[str, str], list[Measurement]] = defaultdict(list)
    for source, provided in SOURCES.items():
        if not provided.isdisjoint(quantities):
            for name, one in source(session, building_id, temperature):
                found[name].append(one)
    return tuple(
        Series(*name, tuple(observations)) for name, observations in sorted(found.items()) if name[0] in quantities
    )


def channels_of(series: Series, description: BuildingDescription) -> tuple[str, ...]:
    """Ids of the channels that a series is measured with."""
    if series.quantity in SENSOR_QUANTITIES:
        return (series.subject,)
    direction = series.subject.partition("/")[0]
    return tuple(channel.id for channel in description.channels if channel.direction == direction)


def _cycles(session: Session, building_id: int, temperature: Mapping[int, float]) -> Iterator[Named]:
    for row in history.all_cycles(session, building_id):
        middle = row.record_start + timedelta(seconds=(row.start + row.end) / 2)
        for quantity, value, std in (("stiffness", row.k_eq, row.k_eq_std), ("damping", row.c_eq, row.c_eq_std)):
            yield from _observed(
                (quantity, row.direction), row.event, middle, value, std, row.amplitude, temperature.get(row.event)
            )


def _residuals(session: Session, building_id: int, temperature: Mapping[int, float]) -> Iterator[Named]:
    for row in history.residuals(session, building_id):
        name = ("residual_displacement", row.direction)
        yield from _observed(name, row.event, row.event_start, row.value, row.std, None, temperature.get(row.event))


def _sensors(session: Session, building_id: int, temperature: Mapping[int, float]) -> Iterator[Named]:
    """Noise and gain; the noise's own standard deviation is negligible beside its scatter between events."""
    for row in history.sensors(session, building_id):
        known = temperature.get(row.event)
        yield from _observed(("noise", row.channel), row.event, row.event_start, row.noise, 0.0, None, known)
        yield from _observed(("gain", row.channel), row.event, row.event_start, row.gain, row.gain_std, None, known)


def _frequencies(session: Session, building_id: int, temperature: Mapping[int, float]) -> Iterator[Named]:
    """Frequencies of established modes over the base shear, represented by the peak force.

    Only established modes are numbered: a spurious one in a single record shifts no number.
    """
    for direction in DIRECTIONS:
        tracked = mode_tracks.tracked_modes(session, building_id, Span(), direction)
        established: Sequence[Sequence[Sighting]] = [mode.sightings for mode in tracked if mode.is_established]
        for number, sightings in enumerate(established, start=1):
            for one in sightings:
                yield from _observed(
                    ("frequency", f"{direction}/{number}"),
                    one.event,
                    one.event_start,
                    one.mode.frequency,
                    one.mode.frequency_std or 0.0,
                    one.peak_force,
                    temperature.get(one.event),
                )


def _model_errors(session: Session, building_id: int, temperature: Mapping[int, float]) -> Iterator[Named]:
    """Errors of the current models over the force; retired models are left out."""
    models = [model.id for model in model_queries.current_versions(session, building_id)]
    compared = model_queries.latest_comparisons(session, models) if models else {}
    peaks = {(row.event, row.direction): row.peak for row in history.peak_displacements(session, building_id)}
    for comparison, event in chain.from_iterable(compared.values()):
        yield from _observed(
            ("model_error", comparison.direction),
            event.id,
            event.start,
            Misfit(**comparison.misfit).nrmse,
            0.0,
            peaks.get((event.id, comparison.direction)),
            temperature.get(event.id),
        )


def _observed(
    name: tuple[str, str],
    event: int,
    time: datetime,
    value: float | None,
    std: float | None,
    amplitude: float | None,
    temperature: float | None,
) -> Iterator[Named]:
    """The measurement, unless it has no value."""
    if value is not None and std is not None and isfinite(value) and isfinite(std):
        yield name, Measurement(event, time, value, std, amplitude, temperature)


SOURCES: Mapping[Callable[[Session, int, Mapping[int, float]], Iterator[Named]], frozenset[str]] = MappingProxyType(
    {
        _cycles: frozenset({"stiffness", "damping"}),
        _residuals: frozenset({"residual_displacement"}),
        _sensors: SENSOR_QUANTITIES,
        _frequencies: frozenset({"frequency"}),
        _model_errors: frozenset({"model_error"}),
    }
)
"""Functions that read a building's measurements, given the temperature of its events, with their quantities."""
