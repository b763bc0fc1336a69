"""Series for drift from the analyses of a building's events.

`drift_series` makes series from analyses at once. A store of results that holds years of events uses its parts: it
reads the rows that a quantity needs, and `measurements_of_cycle`, `measurements_of_sensor`, `measurements_of_modes` and
`measurement` make the same series of them.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from math import isfinite

from core.analysis import HORIZONTAL, EventAnalysis
from core.description import BuildingDescription
from core.drift.deviations import EventNotes
from core.drift.quantities import SENSOR_QUANTITIES
from core.drift.series import Measurement, Series
from core.identification.modes import Mode
from core.identification.tracking import tracks
from core.isolation_layer.equivalent import EquivalentSegment
from core.record import Finding
from core.sensors.sensor_errors import SensorHealth

Named = tuple[tuple[str, str], Measurement]
"""Quantity and subject, and one measurement of them."""
MISSING = "missing"
"""Kind of the finding that a sensor was not recorded (core.sensors.screening)."""


@dataclass(frozen=True, slots=True)
class AnalysedEvent:
    """An event that was analysed."""

    event: int
    """Identifier, unique in the building."""
    start: datetime
    """Aware."""
    temperature: float | None
    """°C; None where it was not measured."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedMode:
    """A mode as one event shows it."""

    event: AnalysedEvent
    mode: Mode
    peak_force: float
    """N, largest restoring force: the measure of how strongly the superstructure was shaken."""


def drift_series(analyses: Sequence[EventAnalysis]) -> dict[tuple[str, str], Series]:
    """Every series that analyses of one building give, by quantity and subject.

    `stiffness`, `damping` and `residual_displacement` are of a direction, `frequency` of an established mode of a
    direction (`x/1`), `noise` and `gain` of a channel. The events are numbered from 0 as they are given. Rejected
    events give the series of their sensors only.

    Args:
        analyses: one of each event, in order of time.
    """
    events = [AnalysedEvent(number, one.start, one.temperature) for number, one in enumerate(analyses)]
    named: list[Named] = []
    for event, one in zip(events, analyses, strict=True):
        named += _measurements_of_layer(event, one)
        for sensor in one.sensors:
            named += measurements_of_sensor(event, sensor)
    for direction in HORIZONTAL:
        named += measurements_of_modes(direction, _established(events, analyses, direction))
    return {(one.quantity, one.subject): one for one in series_of(named)}


def series_of(named: Iterable[Named]) -> tuple[Series, ...]:
    """Measurements as series, by quantity and subject; in each, the measurements keep their order."""
    grouped: dict[tuple[str, str], list[Measurement]] = defaultdict(list)
    for name, one in named:
        grouped[name].append(one)
    return tuple(Series(*name, tuple(measurements)) for name, measurements in sorted(grouped.items()))


def measurement(
    quantity: str,
    subject: str,
    event: AnalysedEvent,
    value: float | None,
    std: float | None,
    *,
    amplitude: float | None = None,
    time: datetime | None = None,
) -> Iterator[Named]:
    """The measurement of an event, unless it has no value.

    Args:
        quantity: key of `core.drift.quantities.QUANTITIES`.
        subject: direction, mode or channel.
        event: the event.
        value: SI units; None where there is none.
        std: standard deviation of the value.
        amplitude: amplitude that belongs to the value; None where the quantity has none.
        time: aware; None for the start of the event.
    """
    if value is not None and std is not None and isfinite(value) and isfinite(std):
        when = event.start if time is None else time
        yield (quantity, subject), Measurement(event.event, when, value, std, amplitude, event.temperature)


def measurements_of_cycle(
    event: AnalysedEvent, direction: str, record_start: datetime, cycle: EquivalentSegment
) -> Iterator[Named]:
    """Stiffness and damping of one cycle of the isolation layer, at its middle and its amplitude."""
    middle = record_start + timedelta(seconds=(cycle.start + cycle.end) / 2)
    for quantity, value, std in (("stiffness", cycle.k_eq, cycle.k_eq_std), ("damping", cycle.c_eq, cycle.c_eq_std)):
        yield from measurement(quantity, direction, event, value, std, amplitude=cycle.amplitude, time=middle)


def measurements_of_sensor(event: AnalysedEvent, sensor: SensorHealth) -> Iterator[Named]:
    """Noise and gain of one channel; the noise's own standard deviation is negligible beside its scatter."""
    yield from measurement("noise", sensor.channel, event, sensor.noise, 0.0)
    yield from measurement("gain", sensor.channel, event, sensor.gain, sensor.gain_std)


def measurements_of_modes(direction: str, established: Iterable[Sequence[IdentifiedMode]]) -> Iterator[Named]:
    """Frequencies of a direction's established modes, each at the peak force of its event.

    Args:
        direction: name of the direction.
        established: each mode over its events, the lowest frequency first. Only established modes are numbered, so that
            a spurious one in a single record shifts no number.
    """
    for number, mode in enumerate(established, start=1):
        for one in mode:
            std = one.mode.frequency_std or 0.0
            subject = f"{direction}/{number}"
            yield from measurement("frequency", subject, one.event, one.mode.frequency, std, amplitude=one.peak_force)


def channels_of(series: Series, description: BuildingDescription) -> tuple[str, ...]:
    """Ids of the channels that a series is measured with."""
    if series.quantity in SENSOR_QUANTITIES:
        return (series.subject,)
    direction = series.subject.partition("/")[0]
    return tuple(channel.id for channel in description.channels if channel.direction == direction)


def sensor_notes(findings: Mapping[int, Sequence[Finding]], channels: Sequence[str]) -> dict[int, EventNotes]:
    """Notes on the events with data quality findings on the channels that measure a series.

    A missing sensor gives no note: one that was removed years ago must not hide the drift since then.

    Args:
        findings: data quality findings by event.
        channels: ids of the channels, as `channels_of` gives.
    """
    own = {
        event: tuple(one for one in every if one.channel in channels and one.kind != MISSING)
        for event, every in findings.items()
    }
    return {event: EventNotes(one) for event, one in own.items() if one}


def _measurements_of_layer(event: AnalysedEvent, analysis: EventAnalysis) -> Iterator[Named]:
    for direction, result in analysis.directions.items():
        for cycle in result.equivalent:
            yield from measurements_of_cycle(event, direction, analysis.start, cycle)
        residual = None if result.motion is None else result.motion.residual
        if residual is not None:
            yield from measurement("residual_displacement", direction, event, residual.value, residual.std)


def _established(
    events: Sequence[AnalysedEvent], analyses: Sequence[EventAnalysis], direction: str
) -> Iterator[list[IdentifiedMode]]:
    """Established modes of a direction over the events with modes, at the floors of the latest of these events."""
    forces = [
        (event, one.directions[name].restoring_force)
        for event, one in zip(events, analyses, strict=True)
        for name in one.directions
        if name == direction
    ]
    with_modes = [(event, force) for event, force in forces if force.modes]
    floors = with_modes[-1][1].modes[0].shape.size if with_modes else 0
    comparable = [(event, force) for event, force in with_modes if force.modes[0].shape.size == floors]
    for track in tracks([force.modes for _, force in comparable]):
        if track.is_established:
            places = [comparable[number] for number in track.events]
            yield [
                IdentifiedMode(event, mode, force.peak[0])
                for (event, force), mode in zip(places, track.modes, strict=True)
            ]
