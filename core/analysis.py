"""The whole chain for one event: the one function that the worker calls."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np

from core.arrays import Vector
from core.assembly import Trace, joined, on_one_time_base
from core.conditioning import band_passed, without_baseline
from core.consistency import disagreements
from core.description import BuildingDescription
from core.displacement import Motion, fuse, integrate
from core.equivalent import EquivalentSegment, cycles, equivalent_segments
from core.errors import CoreError, ModelError, RecordError
from core.estimator import InstrumentedSuperstructure, RestoringForce
from core.estimators import ESTIMATORS
from core.noise import noise_std
from core.quality import Finding
from core.record import Channel, Direction, Record, Segment
from core.screening import loss, missing, screened

ABOVE_NOISE = 10.0
"""Of the displacement's noise: the smallest amplitude of a cycle that is reported."""
KEPT = ("delay", "clock")
"""Kinds of disagreement that leave a channel worth using."""
SMALLEST_CYCLE = 1e-5
"""m, the resolution of a good transducer: no smaller cycle is reported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalysisSettings:
    """What an engineer may choose about an analysis; a result keeps the settings it was made with."""

    estimator: str = "cms"
    """Name of the estimator, one of ESTIMATORS."""
    sensors: tuple[str, ...] | None = None
    """Names of the levels to use, the base slab among them; None: every instrumented one."""
    rate: float = 100.0
    """Hz, to which records are resampled."""
    band: tuple[float, float] = (0.1, 30.0)
    """Hz, pass band of everything that is estimated."""


@dataclass(frozen=True, slots=True, eq=False)
class DirectionAnalysis:
    """What was found in one horizontal direction."""

    restoring_force: RestoringForce
    displacement: Vector | None
    """(n,) m, of the isolation layer; None where nothing measures it."""
    velocity: Vector | None
    """(n,) m/s, of the isolation layer."""
    equivalent: tuple[EquivalentSegment, ...]


@dataclass(frozen=True, slots=True, eq=False)
class EventAnalysis:
    """What was found in one event."""

    start: datetime
    """Time of the first sample of every history."""
    rate: float
    """Hz, of every history."""
    directions: Mapping[Direction, DirectionAnalysis]
    """Empty if the event was refused."""
    quality: tuple[Finding, ...]
    peaks: Mapping[str, float]
    """Largest absolute value by channel id, SI units, its mean removed."""
    pga: float | None
    """m/s², the largest horizontal ground acceleration; None where it was not measured."""
    refusal: str | None
    """Why the event cannot be used: the messages of its fatal findings."""


def analyse(segments: Sequence[Segment], description: BuildingDescription, settings: AnalysisSettings) -> EventAnalysis:
    """Restoring force of the isolation layer and its equivalents, in each direction that the record allows.

    Bad data raises nothing: what cannot be used is a finding, and a direction with a fatal one is left out; if no
    direction is left the event is refused. The force is band-passed. The displacement is not high-passed, so that
    the layer's residual offset stays in it: the regressions have an intercept, and only the instants at which a cycle
    begins come from the band-passed displacement.

    Args:
        segments: what was recorded, in any order; channels that the description does not list are ignored.
        description: of the building.
        settings: the engineer's choices.
    """
    found: list[Finding] = []
    try:
        record = _record(segments, description, settings, found)
    except CoreError as error:
        found.append(Finding("record", "fatal", str(error)))
        start = min((segment.start for segment in segments), default=datetime.min.replace(tzinfo=UTC))
        return EventAnalysis(start, settings.rate, {}, tuple(found), {}, None, _refusal(found))
    wrong = disagreements(record, description)
    found += wrong
    trusted = _without(record, {finding.channel for finding in wrong if finding.kind not in KEPT})
    directions: dict[Direction, DirectionAnalysis] = {}
    for direction in description.horizontal_directions:
        try:
            directions[direction] = _direction(trusted, description, settings, direction, found)
        except CoreError as error:
            found.append(Finding("direction", "fatal", f"direction {direction}: {error}"))
    if not directions and all(finding.severity != "fatal" for finding in found):
        found.append(Finding("direction", "fatal", "no horizontal acceleration of the base slab is described"))
    return EventAnalysis(
        start=record.start,
        rate=record.rate,
        directions=directions,
        quality=tuple(found),
        peaks={
            channel.id: float(np.abs(row).max()) for channel, row in zip(record.channels, record.samples, strict=True)
        },
        pga=_pga(record, description),
        refusal=None if directions else _refusal(found),
    )


def _record(
    segments: Sequence[Segment], description: BuildingDescription, settings: AnalysisSettings, found: list[Finding]
) -> Record:
    """The usable channels on one time base, each about its position at rest; appends what was found."""
    traces: dict[str, Trace] = {}
    pieces: dict[str, list[Segment]] = defaultdict(list)
    for segment in segments:
        pieces[segment.channel].append(segment)
    wanted = [channel for channel in description.channels if channel.quantity != "temperature"]
    for channel in wanted:
        if channel.id in pieces:
            trace, findings = _trace(pieces[channel.id], channel, description)
            found += findings
            if trace is not None:
                traces[channel.id] = trace
    found += missing(wanted, set(pieces), description)
    used = tuple(channel for channel in wanted if channel.id in traces)
    if not used:
        raise RecordError("no channel of the description can be used; see the other findings")
    record = on_one_time_base(traces, used, settings.rate)
    rows = [without_baseline(row, record.rate) for row in _complete(record, description, found)]
    kept = tuple(c for c, row in zip(record.channels, record.samples, strict=True) if np.isfinite(row).all())
    return replace(record, channels=kept, samples=np.array(rows))


def _trace(
    pieces: Sequence[Segment], channel: Channel, description: BuildingDescription
) -> tuple[Trace | None, tuple[Finding, ...]]:
    lost = loss(channel, description)
    try:
        trace, overlaps = joined(pieces)
    except RecordError as error:
        return None, (Finding("record", lost, f"the channel {error}", channel.id),)
    usable, findings = screened(trace, channel, lost)
    return usable, (*overlaps, *findings)


def _complete(record: Record, description: BuildingDescription, found: list[Finding]) -> list[Vector]:
    """The rows that cover the whole time base; appends a finding for every other."""
    rows: list[Vector] = []
    for channel, row in zip(record.channels, record.samples, strict=True):
        if np.isfinite(row).all():
            rows.append(row)
            continue
        absent = float(np.sum(~np.isfinite(row)) / record.rate)
        message = f"does not cover {absent:.3g} s of the event and is left out; send the rest and analyse again"
        found.append(Finding("gap", loss(channel, description), message, channel.id, absent))
    if not rows:
        raise RecordError("no channel covers the whole event; send the rest and analyse again")
    return rows


def _without(record: Record, left_out: set[str | None]) -> Record:
    kept = [row for row, channel in enumerate(record.channels) if channel.id not in left_out]
    return replace(record, channels=tuple(record.channels[row] for row in kept), samples=record.samples[kept])


def _direction(
    record: Record,
    description: BuildingDescription,
    settings: AnalysisSettings,
    direction: Direction,
    found: list[Finding],
) -> DirectionAnalysis:
    superstructure = _superstructure(record, description, settings, direction)
    if settings.estimator not in ESTIMATORS:
        raise ModelError(f"no estimator is called {settings.estimator!r}; there are {sorted(ESTIMATORS)}")
    force = ESTIMATORS[settings.estimator](superstructure)
    motion = _motion(record, description, settings, direction, found)
    if motion is None:
        return DirectionAnalysis(force, None, None, ())
    within = band_passed(motion.displacement, record.rate, settings.band)
    noise = float(noise_std(motion.displacement[None, :], record.rate)[0])
    spans = cycles(within, max(SMALLEST_CYCLE, ABOVE_NOISE * noise))
    height = description.isolation.rubber_height
    equivalent = equivalent_segments(force.force, motion, record.rate, spans, height)
    return DirectionAnalysis(force, motion.displacement, motion.velocity, equivalent)


def _superstructure(
    record: Record, description: BuildingDescription, settings: AnalysisSettings, direction: Direction
) -> InstrumentedSuperstructure:
    """What the estimator may know: the band-passed accelerations of the chosen levels."""
    chosen = _chosen_levels(description, settings)
    base = record.find(description.base.name, "acceleration", direction)
    if base is None:
        raise RecordError("the base slab's acceleration cannot be used; nothing can be estimated without it")
    floors = {
        index: samples
        for index, level in enumerate(description.floors)
        if level.name in chosen and (samples := record.find(level.name, "acceleration", direction)) is not None
    }
    if not floors:
        raise RecordError("no floor above the base slab was recorded; one, best the roof, would do")
    accelerations = band_passed(np.array([base, *floors.values()]), record.rate, settings.band)
    return InstrumentedSuperstructure(
        rate=record.rate,
        base_acceleration=accelerations[0],
        floor_acceleration=accelerations[1:],
        measured=np.array(list(floors), dtype=np.intp),
        base_mass=description.base_mass,
        floor_mass=description.floor_mass,
        storey_stiffness=description.storey_stiffness,
    )


def _chosen_levels(description: BuildingDescription, settings: AnalysisSettings) -> set[str]:
    names = [level.name for level in description.levels]
    chosen = set(names if settings.sensors is None else settings.sensors)
    aliases = {"base": description.base.name}
    chosen = {aliases.get(name, name) if name not in names else name for name in chosen}
    if unknown := sorted(chosen - set(names)):
        raise ModelError(f"no level is called {unknown}; there are {names}")
    if description.base.name not in chosen:
        raise ModelError(f"the sensors {sorted(chosen)} leave out the base slab, {description.base.name!r}; add it")
    return chosen


def _motion(
    record: Record,
    description: BuildingDescription,
    settings: AnalysisSettings,
    direction: Direction,
    found: list[Finding],
) -> Motion | None:
    """Motion of the layer from whatever measures it, None if nothing does."""
    base, ground = description.base.name, description.ground.name
    displacement = record.find(base, "displacement", direction)
    above, below = record.find(base, "acceleration", direction), record.find(ground, "acceleration", direction)
    if above is None or below is None:
        if displacement is None:
            message = f"direction {direction}: neither displacement nor ground acceleration; no motion of the layer"
            found.append(Finding("displacement", "warning", message))
            return None
        # An acceleration of infinite noise counts for nothing: the displacement alone is differentiated.
        smooth = band_passed(displacement, record.rate, settings.band)
        return fuse(smooth, np.zeros_like(smooth), record.rate, displacement_noise=0.0, acceleration_noise=1.0)
    relative = above - below
    if displacement is None:
        message = (
            f"direction {direction}: no displacement was measured; it was integrated from the accelerations above "
            f"{settings.band[0]:g} Hz, without the layer's residual offset"
        )
        found.append(Finding("displacement", "note", message))
        return integrate(relative, record.rate, settings.band[0])
    noise = noise_std(np.array([displacement, relative]), record.rate)
    return fuse(
        displacement, relative, record.rate, displacement_noise=float(noise[0]), acceleration_noise=float(noise[1])
    )


def _pga(record: Record, description: BuildingDescription) -> float | None:
    horizontal = [record.find(description.ground.name, "acceleration", direction) for direction in ("x", "y")]
    return max((float(np.abs(samples).max()) for samples in horizontal if samples is not None), default=None)


def _refusal(found: Sequence[Finding]) -> str:
    fatal = [finding for finding in found if finding.severity == "fatal"]
    return "; ".join(
        f"{finding.channel}: {finding.message}" if finding.channel else finding.message for finding in fatal
    )
