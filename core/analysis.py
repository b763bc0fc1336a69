"""The whole chain for one event: the one function that the worker calls."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime

import numpy as np

from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.errors import CoreError, ModelError
from core.estimators import ESTIMATORS
from core.estimators.model_error import with_mass_errors
from core.estimators.result import RestoringForce, assessment_findings
from core.estimators.superstructure import instrumented_superstructure
from core.isolation_layer.equivalent import (
    EquivalentSegment,
    cycles,
    determined,
    equivalent_segments,
    with_force_errors,
    with_slow_errors,
)
from core.isolation_layer.layer import AxialLoad, axial_load, layer_motion, layer_torsion
from core.isolation_layer.motion import Integral, MeasuredMotion
from core.record import Direction, Finding, Record, Segment
from core.sensors.layer_agreement import LayerAgreement, recorded_agreement
from core.sensors.preparation import prepared
from core.sensors.reconciliation import reconciled
from core.sensors.sensor_errors import SensorDifference, SensorHealth, sensor_differences, sensor_health
from core.shaking.floors import FloorMotion, floor_motion
from core.shaking.measures import Shaking, shaking
from core.signals.conditioning import band_passed
from core.tables import Table, report
from core.units import quantity

ABOVE_NOISE = 10.0
"""Smallest amplitude of a reported cycle, in standard deviations of the displacement's noise. A choice."""
HORIZONTAL: tuple[Direction, Direction] = ("x", "y")
"""Horizontal directions of the building."""
MOVING = 2.0
"""Speed of the isolation layer, in its standard deviations, from which on it counts as moving. A choice."""
SMALLEST_CYCLE = 1e-5
"""m, the resolution of a good transducer: no smaller cycle is reported."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnalysisSettings:
    """Settings of an analysis; a result keeps its settings."""

    estimator: str = "smoother"
    """Name of the estimator, one of ESTIMATORS."""
    sensors: tuple[str, ...] | None = None
    """Names of the levels to use, the base slab among them; None: every instrumented one."""
    rate: float = 100.0
    """Hz, to which records are resampled."""
    band: tuple[float, float] = (0.1, 30.0)
    """Hz, pass band of everything that is estimated."""
    integral: Integral = "recorded"
    """Motion from a displacement channel that was integrated from accelerations: recorded or restored."""


USUAL = AnalysisSettings()
"""Settings of an analysis where none are given."""


@dataclass(frozen=True, slots=True, eq=False)
class DirectionAnalysis:
    """Results in one horizontal direction."""

    restoring_force: RestoringForce
    motion: MeasuredMotion | None
    """Motion of the isolation layer; None without a suitable sensor."""
    equivalent: tuple[EquivalentSegment, ...]

    @property
    def displacement(self) -> Vector | None:
        """(n,) m, of the isolation layer."""
        return None if self.motion is None else self.motion.displacement

    @property
    def velocity(self) -> Vector | None:
        """(n,) m/s, of the isolation layer."""
        return None if self.motion is None else self.motion.velocity


@dataclass(frozen=True, slots=True, eq=False)
class EventAnalysis:
    """Results of one event."""

    start: datetime
    """Time of the first sample of every history."""
    rate: float
    """Hz, of every history."""
    count: int
    """Samples of every history."""
    directions: Mapping[Direction, DirectionAnalysis]
    """Empty if the event was refused."""
    quality: tuple[Finding, ...]
    peaks: Mapping[str, float]
    """Largest absolute value by channel id, SI units, its mean removed."""
    pga: float | None
    """m/s², the largest horizontal ground acceleration; None where it was not measured."""
    torsion: MeasuredMotion | None
    """Torsion of the isolation layer, rad and rad/s from x towards y; None if the sensors' positions do not determine
    it."""
    axial_load: AxialLoad | None
    """On the isolators; None where nothing measures a vertical acceleration."""
    refusal: str | None
    """Reasons why the event cannot be used: the messages of its fatal findings."""
    record: Record | None = None
    """Channels on one time base about their position at rest, one for each level, quantity and direction; None if the
    segments made none."""
    temperature: float | None = None
    """°C, mean of what thermometers measured; None where nothing did."""
    band: tuple[float, float] | None = None
    """Hz, that the accelerations had passed from which forces were estimated; None if nothing was."""
    sensors: tuple[SensorHealth, ...] = ()
    """Noise and gain of every channel that could be used."""
    shaking: Shaking | None = None
    """Strength of the earthquake at the ground, or at the lowest level with an accelerometer; None without one."""
    floors: tuple[FloorMotion, ...] = ()
    """Motion of the floors in each direction of `directions`."""
    differences: Mapping[Direction, tuple[SensorDifference, ...]] = field(default_factory=dict)
    """Differences in gain and clock between the sensors of `record`, in each horizontal direction of the building."""

    def __str__(self) -> str:
        title = f"Analysis of the event of {self.start:%Y-%m-%d %H:%M:%S} UTC"
        opening = [f"{self.count} samples at {self.rate:g} Hz, {self.count / self.rate:.4g} s."]
        opening += [] if self.pga is None else [f"Peak ground acceleration: {quantity(self.pga, 'm/s²')}."]
        opening += [] if self.temperature is None else [f"Temperature: {quantity(self.temperature, '°C')}."]
        opening += [] if self.refusal is None else [f"Rejected: {self.refusal}."]
        headings = ("direction", "peak force", "peak displacement", "modes", "cycles")
        rows = tuple(_row(direction, analysed) for direction, analysed in self.directions.items())
        table = Table("Isolation layer", headings, rows) if rows else None
        return report(title, opening, table, [f"{one.severity.capitalize()}: {one.message}" for one in self.quality])

    @property
    def orbit(self) -> Matrix | None:
        """(2, n) m, displacement of the isolation layer in x and y; None unless both are known."""
        path = [one.displacement for name in HORIZONTAL if (one := self.directions.get(name)) is not None]
        known = [displacement for displacement in path if displacement is not None]
        return np.array(known) if len(known) == len(HORIZONTAL) else None

    @property
    def peak_resultant(self) -> float | None:
        """m, largest displacement of the isolation layer in plan; None unless both directions are known."""
        return None if self.orbit is None else float(np.hypot(*self.orbit).max())

    @property
    def travel(self) -> float | None:
        """m, length of the isolation layer's path in plan above the velocity's noise; None unless both directions are
        known."""
        motions = [one.motion for one in self.directions.values() if one.motion is not None]
        if len(motions) < len(HORIZONTAL):
            return None
        speed = np.hypot(*(motion.velocity for motion in motions))
        noise = np.hypot(*(motion.velocity_std for motion in motions))
        return float(np.sum(speed[speed > MOVING * noise])) / self.rate


def _row(direction: Direction, analysed: DirectionAnalysis) -> tuple[str, ...]:
    force, force_std = analysed.restoring_force.peak
    moved = (
        "not measured" if analysed.motion is None else quantity(analysed.motion.peak[0], "m", analysed.motion.peak[1])
    )
    modes, cycles = len(analysed.restoring_force.modes), len(analysed.equivalent)
    return (direction, quantity(force, "N", force_std), moved, str(modes), str(cycles))


def analyse(
    segments: Sequence[Segment], description: BuildingDescription, settings: AnalysisSettings = USUAL
) -> EventAnalysis:
    """Restoring force of the isolation layer and its equivalents, in each direction that the record allows.

    Bad data raises nothing: what cannot be used is a finding, and a direction with a fatal one is left out; if no
    direction is left the event is refused.

    Args:
        segments: what was recorded, in any order; channels that the description does not list are ignored.
        description: of the building.
        settings: the engineer's choices.

    Raises:
        ModelError: there is no estimator of the name in the settings.
    """
    if settings.estimator not in ESTIMATORS:
        raise ModelError(f"no estimator is called {settings.estimator!r}; there are {', '.join(sorted(ESTIMATORS))}")
    preparation = prepared(segments, description, settings.rate)
    problems, record = list(preparation.findings), preparation.record
    if record is None:
        start = min((segment.start for segment in segments), default=datetime.min.replace(tzinfo=UTC))
        return EventAnalysis(
            start=start,
            rate=settings.rate,
            count=0,
            directions={},
            quality=tuple(problems),
            peaks={},
            pga=None,
            torsion=None,
            axial_load=None,
            refusal=_refusal(problems),
        )
    levels = reconciled(record, description)
    torsion, torsion_findings = layer_torsion(levels, description)
    load, load_findings = axial_load(levels.record, description, settings.band)
    problems += [*levels.findings, *torsion_findings, *load_findings]
    agreements = {
        direction: recorded_agreement(levels.record, description, direction)
        for direction in description.horizontal_directions
    }
    directions: dict[Direction, DirectionAnalysis] = {}
    for direction, agreement in agreements.items():
        try:
            directions[direction], findings = _direction(levels.record, description, settings, direction, agreement)
            problems += findings
        except CoreError as error:
            problems.append(Finding("direction", "fatal", f"direction {direction}: {error}"))
    if not directions and all(finding.severity != "fatal" for finding in problems):
        problems.append(Finding("direction", "fatal", "no horizontal acceleration of the base slab is described"))
    differences = {
        direction: tuple(sensor_differences(levels.record, description, direction, agreement))
        for direction, agreement in agreements.items()
    }
    health = sensor_health(record, differences.values())
    return EventAnalysis(
        start=record.start,
        rate=record.rate,
        count=record.samples.shape[1],
        directions=directions,
        quality=tuple(problems),
        peaks={c.id: float(np.abs(row).max()) for c, row in zip(record.channels, record.samples, strict=True)},
        pga=_pga(levels.record, description),
        torsion=torsion,
        axial_load=load,
        refusal=None if directions else _refusal(problems),
        record=levels.record,
        temperature=_temperature(segments, description),
        band=settings.band,
        sensors=health,
        shaking=shaking(levels.record, description),
        floors=tuple(
            floor_motion(levels.record, description, direction, one.restoring_force, _noise(record, direction, health))
            for direction, one in directions.items()
        ),
        differences=differences,
    )


def _direction(
    record: Record,
    description: BuildingDescription,
    settings: AnalysisSettings,
    direction: Direction,
    agreement: LayerAgreement | None,
) -> tuple[DirectionAnalysis, tuple[Finding, ...]]:
    superstructure = instrumented_superstructure(record, description, direction, settings.sensors, settings.band)
    estimate = ESTIMATORS[settings.estimator](superstructure)
    force = with_mass_errors(estimate, superstructure, description.mass_uncertainty)
    motion, findings = layer_motion(record, description, direction, settings.integral, agreement)
    findings += assessment_findings(force.assessment, direction)
    if motion is None:
        return DirectionAnalysis(_slim(force), None, ()), findings
    equivalent = equivalent_cycles(force, motion, record.rate, settings.band, description.isolation.rubber_height)
    return DirectionAnalysis(_slim(force), motion, equivalent), findings


def _slim(force: RestoringForce) -> RestoringForce:
    """The force without its systematic errors' histories, which are large and of use for the equivalents alone."""
    return replace(force, systematic=None)


def equivalent_cycles(
    force: RestoringForce,
    motion: MeasuredMotion,
    rate: float,
    band: tuple[float, float],
    rubber_height: float | None = None,
) -> tuple[EquivalentSegment, ...]:
    """Equivalent stiffness and damping of every cycle that determines them.

    Only the instants at which one begins come from the band-passed displacement: the regressions have an intercept.

    Args:
        force: of the isolation layer.
        motion: of the isolation layer, as many samples.
        rate: Hz.
        band: Hz, pass band of the force.
        rubber_height: m, displacement of 100 % shear strain.
    """
    within = band_passed(motion.displacement, rate, band)
    spans = cycles(within, max(SMALLEST_CYCLE, ABOVE_NOISE * motion.noise))
    segments = determined(equivalent_segments(force.force, motion, rate, spans, rubber_height))
    if force.systematic is not None:
        segments = with_force_errors(segments, force.systematic, motion, rate)
    return with_slow_errors(segments, motion, rate)


def _noise(record: Record, direction: Direction, health: Sequence[SensorHealth]) -> dict[str, float | None]:
    """m/s² by level, standard deviation of the accelerometers' noise in one direction."""
    channels = {channel.id: channel for channel in record.channels}
    return {
        channels[one.channel].level: one.noise
        for one in health
        if channels[one.channel].quantity == "acceleration" and channels[one.channel].direction == direction
    }


def _pga(record: Record, description: BuildingDescription) -> float | None:
    horizontal = [record.find(description.ground.name, "acceleration", direction) for direction in HORIZONTAL]
    return max((float(np.abs(samples).max()) for samples in horizontal if samples is not None), default=None)


def _temperature(segments: Sequence[Segment], description: BuildingDescription) -> float | None:
    """The mean: isolators follow the weather over hours, and an earthquake lasts minutes."""
    thermometers = {channel.id for channel in description.channels if channel.quantity == "temperature"}
    read = [segment.samples for segment in segments if segment.channel in thermometers and segment.samples.size]
    measured = np.concatenate(read) if read else np.empty(0)
    return float(np.nanmean(measured)) if np.isfinite(measured).any() else None


def _refusal(quality: Sequence[Finding]) -> str:
    fatal = [finding for finding in quality if finding.severity == "fatal"]
    return "; ".join(
        f"{finding.channel}: {finding.message}" if finding.channel else finding.message for finding in fatal
    )
