"""Restoring force, motion and equivalents of an isolation layer from plain arrays.

The arrays become a record and a building's description, and the functions behind `core.analyse` do the rest: sensors
are checked, and samples at more than 100 Hz are resampled to that rate, as the service does it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from core.analysis import USUAL, equivalent_cycles
from core.arrays import Vector
from core.description import BuildingDescription, IsolationLayer, Level
from core.errors import ModelError, RecordError
from core.estimators import ESTIMATORS
from core.estimators.result import RestoringForce, assessment_findings
from core.estimators.superstructure import instrumented_superstructure
from core.isolation_layer.equivalent import EquivalentSegment
from core.isolation_layer.layer import layer_motion as measured_motion
from core.isolation_layer.motion import MeasuredMotion
from core.record import Channel, Quantity, Record, Segment
from core.rounding import with_std
from core.sensors.layer_agreement import transducer_reading
from core.sensors.preparation import prepared
from core.signals.conditioning import without_baseline
from core.tables import Table, report
from core.units import quantity

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
"""Start of records whose time is not given."""
BAND = (0.1, 30.0)
"""Hz, usual pass band of forces."""
GROUND, BASE = "ground", "base slab"
"""Names of the two lowest levels."""
STRONGEST = 100.0
"""m/s², about ten times gravity: an acceleration beyond it is in another unit."""
FARTHEST = 10.0
"""m: a displacement of an isolation layer beyond it is in another unit."""
SHOWN = 12
"""Cycles that a report shows."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ForceHistory(RestoringForce):
    """The isolation layer's restoring force in one direction, with the record that it was estimated from."""

    rate: float
    """Hz."""
    band: tuple[float, float]
    """Hz, that the accelerations had passed."""
    building: BuildingDescription
    """Masses and measured floors."""
    record: Record
    """Accelerations without their baselines."""
    given: tuple[float, int]
    """Hz and number of samples of the arrays that were given."""
    remarks: tuple[str, ...] = ()
    """Faults of the sensors, and what was done about them."""

    def __str__(self) -> str:
        title = f"Restoring force by the estimator {self.estimator!r}: {_span(self.force.size, self.rate)}"
        peak, weakest = quantity(self.peak[0], "N", self.peak[1]), float(np.sqrt(np.mean(self.fitting_std**2)))
        sentences = [
            f"Peak force: {peak}, within {self.band[0]:g} to {self.band[1]:g} Hz.",
            f"Noise of the force: {quantity(weakest, 'N')} (root mean square of its standard deviation).",
        ]
        weak = [finding.message for finding in assessment_findings(self.assessment, "x")]
        return report(title, sentences, _modes(self), [*weak, *self.remarks])


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class MotionHistory(MeasuredMotion):
    """The isolation layer's motion in one direction."""

    rate: float
    """Hz."""
    is_by_transducer: bool
    """True if a transducer measured the displacement; otherwise it is integrated and has no offset."""
    remarks: tuple[str, ...] = ()
    """Assumptions, and faults of the sensors."""

    def __str__(self) -> str:
        sentences = [f"Peak displacement: {quantity(self.peak[0], 'm', self.peak[1])}."]
        if self.residual is not None:
            sentences.append(f"Residual displacement: {quantity(self.residual.value, 'm', self.residual.std)}.")
        source = "by a transducer" if self.is_by_transducer else "integrated from accelerations"
        lowest = f", without anything below {self.band[0]:.2g} Hz" if self.is_integrated else ""
        sentences.append(f"The displacement is {source}{lowest}.")
        title = f"Motion of the isolation layer: {_span(self.displacement.size, self.rate)}"
        return report(title, sentences, self.remarks)


@dataclass(frozen=True, slots=True, eq=False)
class Equivalents(Sequence[EquivalentSegment]):
    """Equivalent stiffness and damping of the isolation layer, cycle by cycle."""

    segments: tuple[EquivalentSegment, ...] = field(default=())

    def __len__(self) -> int:
        return len(self.segments)

    def __getitem__(self, number: Any) -> Any:  # noqa: ANN401  an index or a slice
        return self.segments[number]

    def __iter__(self) -> Iterator[EquivalentSegment]:
        return iter(self.segments)

    def __str__(self) -> str:
        title = f"Equivalent stiffness and damping of {len(self)} cycles"
        if not self.segments:
            return report(title, ["No cycle determines them: the motion is too weak, or no oscillation."])
        largest = sorted(self.segments, key=lambda one: -one.amplitude)[:SHOWN]
        note = f"The {SHOWN} largest of {len(self)} cycles." if len(self) > SHOWN else ""
        rows = tuple(_row(one) for one in sorted(largest, key=lambda one: one.start))
        strain = [] if largest[0].shear_strain is None else ["shear strain"]
        headings = ("from", "to", "amplitude", *strain, "stiffness", "damping coefficient")
        return report(title, Table("By time", headings, rows, note))


def restoring_force(
    rate: float,
    *,
    base: ArrayLike,
    floors: ArrayLike,
    measured: Sequence[int],
    masses: ArrayLike,
    stiffness: ArrayLike | None = None,
    band: tuple[float, float] = BAND,
    estimator: str = "smoother",
) -> ForceHistory:
    """Restoring force of the isolation layer from accelerations above it.

    Args:
        rate: Hz.
        base: (n,) m/s², absolute acceleration of the base slab.
        floors: (measured, n) m/s², of the measured floors from the lowest to the roof.
        measured: (measured,) indices of these floors, 0 for the lowest above the base slab.
        masses: (1 + floors,) kg, of the base slab and then of all floors.
        stiffness: (floors,) N/m, design stiffness of the storey below each floor; None if it is not known.
        band: Hz, pass band.
        estimator: `smoother`, the project's own, or `cms`, component mode synthesis.

    Raises:
        RecordError: samples have gaps, wrong shapes or another unit, or the record is too short for the band.
        ModelError: masses or stiffnesses do not fit the floors, or there is no such estimator.
    """
    if estimator not in ESTIMATORS:
        raise ModelError(f"no estimator is called {estimator!r}; there are {', '.join(sorted(ESTIMATORS))}")
    above = _vector("base", base)
    rows = [_vector("floors", row) for row in np.atleast_2d(np.asarray(floors, dtype=float))]
    description = _described(_vector("masses", masses), stiffness, measured, len(rows))
    names = [BASE, *(description.floors[index].name for index in measured)]
    samples: list[tuple[str, Quantity, Vector]] = [
        (name, "acceleration", row) for name, row in zip(names, [above, *rows], strict=True)
    ]
    record, remarks = _record(rate, samples, description)
    superstructure = instrumented_superstructure(record, description, "x", None, band)
    estimate = ESTIMATORS[estimator](superstructure)
    known = {one.name: getattr(estimate, one.name) for one in fields(RestoringForce)}
    return ForceHistory(
        **known,
        rate=record.rate,
        band=band,
        building=description,
        record=record,
        given=(rate, above.size),
        remarks=remarks,
    )


def layer_motion(
    rate: float,
    *,
    displacement: ArrayLike | None = None,
    base: ArrayLike | None = None,
    ground: ArrayLike | None = None,
) -> MotionHistory:
    """Displacement and velocity of the isolation layer, from a transducer, from accelerations, or from both.

    A displacement that was integrated from the same accelerations counts as integrated.

    Args:
        rate: Hz.
        displacement: (n,) m, of the base slab relative to the ground.
        base: (n,) m/s², absolute acceleration of the base slab.
        ground: (n,) m/s², of the ground.

    Raises:
        RecordError: samples have gaps, wrong shapes or another unit, or nothing determines the motion.
    """
    given: list[tuple[str, Quantity, str, ArrayLike | None]] = [
        (BASE, "displacement", "displacement", displacement),
        (BASE, "acceleration", "base", base),
        (GROUND, "acceleration", "ground", ground),
    ]
    samples = [(level, what, _vector(name, values)) for level, what, name, values in given if values is not None]
    if displacement is None and (base is None or ground is None):
        raise RecordError("a displacement, or the accelerations of base slab and ground, are needed for the motion")
    description = _described(np.ones(2), None, [0], 1)
    record, faults = _record(rate, samples, description)
    motion, findings = measured_motion(record, description, "x")
    remarks = (*faults, *(finding.message.removeprefix("direction x: ") for finding in findings))
    if motion is None:
        raise RecordError("; ".join(remarks))
    known = {one.name: getattr(motion, one.name) for one in fields(MeasuredMotion)}
    is_by_transducer = transducer_reading(record, description, "x") is not None
    return MotionHistory(**known, rate=record.rate, is_by_transducer=is_by_transducer, remarks=remarks)


def equivalents(force: ForceHistory, motion: MotionHistory, rubber_height: float | None = None) -> Equivalents:
    """Equivalent stiffness and damping of every cycle that determines them.

    Args:
        force: of the isolation layer.
        motion: of the isolation layer, as many samples at the same rate.
        rubber_height: m, displacement of 100 % shear strain.

    Raises:
        RecordError: force and motion have other lengths or rates.
    """
    check_alike(force, motion)
    return Equivalents(equivalent_cycles(force, motion, force.rate, force.band, rubber_height))


def check_alike(force: ForceHistory, motion: MotionHistory) -> None:
    """Refuse a force and a motion that are not of the same samples.

    Raises:
        RecordError: they have other lengths or rates.
    """
    if (force.force.size, force.rate) != (motion.displacement.size, motion.rate):
        raise RecordError(
            f"the force has {_span(force.force.size, force.rate)}, the motion "
            f"{_span(motion.displacement.size, motion.rate)}; put both on one time base"
        )


def beside(force: ForceHistory, name: str, acceleration: ArrayLike) -> Vector:
    """(n,) m/s², an acceleration on the time base of a force, without its baseline.

    Raises:
        RecordError: it has gaps, another unit, or another number of samples than the force's accelerations had.
    """
    (rate, count), values = force.given, _vector(name, acceleration)
    if values.size != count:
        raise RecordError(f"{name}: {count} samples are needed, as the base slab's acceleration has, got {values.size}")
    record, _ = _record(rate, [(GROUND, "acceleration", values)], force.building)
    return np.asarray(record.samples[0])


def _vector(name: str, values: ArrayLike) -> Vector:
    vector = np.asarray(values, dtype=float)
    if vector.ndim != 1 or not vector.size:
        raise RecordError(f"{name}: one row of numbers is needed, got an array of shape {vector.shape}")
    if gaps := int(np.count_nonzero(~np.isfinite(vector))):
        raise RecordError(f"{name}: {gaps} of {vector.size} samples are gaps (NaN); mend or cut them first")
    return vector


def _record(
    rate: float, samples: Sequence[tuple[str, Quantity, Vector]], description: BuildingDescription
) -> tuple[Record, tuple[str, ...]]:
    """Samples of levels in direction x as `core.analyse` prepares them, and what is weak about them."""
    if not rate > 0:
        raise RecordError(f"the sampling rate must be positive, got {rate} Hz")
    lengths = {f"{what} of {level}": values.size for level, what, values in samples}
    if len(set(lengths.values())) > 1:
        each = ", ".join(f"{name} {count}" for name, count in lengths.items())
        raise RecordError(f"the histories differ in length ({each} samples); put all on one time base")
    for level, what, values in samples:
        _check_unit(level, what, without_baseline(values, rate))
    channels = tuple(Channel(f"{what} of {level}", level, what, "x") for level, what, _ in samples)
    segments = [Segment(of.id, EPOCH, rate, values) for of, (_, _, values) in zip(channels, samples, strict=True)]
    preparation = prepared(segments, replace(description, channels=channels), min(rate, USUAL.rate))
    remarks = tuple(f"{one.channel}: {one.message}" if one.channel else one.message for one in preparation.findings)
    lost = any(one.severity == "fatal" and one.channel in {of.id for of in channels} for one in preparation.findings)
    if preparation.record is None or lost:
        raise RecordError("; ".join(remarks))
    return preparation.record, remarks


def _check_unit(level: str, what: Quantity, values: Vector) -> None:
    most, unit, other = (STRONGEST, "m/s²", "gal (0.01 m/s²)") if what == "acceleration" else (FARTHEST, "m", "mm")
    peak = float(np.abs(values).max())
    if peak > most:
        raise RecordError(f"{what} of {level}: a peak of {peak:.3g} {unit} is not possible; is it in {other}?")


def _described(masses: Vector, stiffness: ArrayLike | None, measured: Sequence[int], rows: int) -> BuildingDescription:
    count = masses.size - 1
    if count < 1:
        raise ModelError("masses are those of the base slab and of one floor or more, got one mass only")
    if len(measured) != rows:
        raise RecordError(f"floors: {rows} rows are given, but `measured` names {len(measured)} floors")
    if sorted(set(measured)) != list(measured) or not all(0 <= index < count for index in measured):
        raise ModelError(f"measured: rising indices from 0 to {count - 1} are needed, got {list(measured)}")
    storeys: Sequence[float | None] = [None] * count
    if stiffness is not None:
        known = _vector("stiffness", stiffness)
        if known.size != count:
            raise ModelError(f"stiffness: {count} storeys are needed for {count + 1} masses, got {known.size}")
        storeys = known.tolist()
    floors = [
        Level(f"floor {number}", "floor", float(mass), stiff)
        for number, (mass, stiff) in enumerate(zip(masses[1:], storeys, strict=True), start=1)
    ]
    levels = (Level(GROUND, "ground"), Level(BASE, "base", float(masses[0])), *floors)
    named = (GROUND, BASE, *(floors[index].name for index in measured))
    channels = tuple(Channel(f"{name} acceleration", name, "acceleration", "x") for name in named)
    return BuildingDescription("ARRAYS", "a building given as arrays", levels, IsolationLayer(), channels)


def _span(count: int, rate: float) -> str:
    return f"{count} samples at {rate:g} Hz, {count / rate:.4g} s"


def _modes(force: RestoringForce) -> Table | None:
    if not force.modes:
        return None
    rows = tuple(
        (
            str(number),
            with_std(mode.frequency, mode.frequency_std, "Hz"),
            with_std(
                100 * mode.damping_ratio, None if mode.damping_ratio_std is None else 100 * mode.damping_ratio_std, "%"
            ),
        )
        for number, mode in enumerate(force.modes, start=1)
    )
    return Table("Modes of the superstructure on a fixed base", ("mode", "frequency", "damping ratio"), rows)


def _row(one: EquivalentSegment) -> tuple[str, ...]:
    return (
        f"{one.start:.2f} s",
        f"{one.end:.2f} s",
        quantity(one.amplitude, "m"),
        *([] if one.shear_strain is None else [f"{100 * one.shear_strain:.1f} %"]),
        quantity(one.k_eq, "N/m", one.k_eq_std),
        quantity(one.c_eq, "N s/m", one.c_eq_std),
    )
