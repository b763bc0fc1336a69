"""Observations of the isolation layer: one earthquake in one direction, as models are compared with it."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from core.analysis import EventAnalysis
from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.estimates import EPOCH, ForceHistory, MotionHistory, beside, check_alike
from core.estimators.result import ErrorSpectrum, RestoringForce
from core.isolation_layer.layer import GRAVITY
from core.isolation_layer.motion import MeasuredMotion
from core.model.force_response import Excitation, excitation
from core.model.isolator import Conditions
from core.record import Direction, Record
from core.sensors.layer_agreement import transducer_reading
from core.signals.conditioning import band_passed, without_baseline
from core.tables import report
from core.units import quantity

USUAL_TEMPERATURE = 20.0
"""°C, where none was measured."""
CROSS: Mapping[Direction, Direction] = {"x": "y", "y": "x"}
"""The other horizontal direction."""


@dataclass(frozen=True, slots=True, eq=False)
class LayerHistory:
    """Force and motion of the layer in one direction, as an analysis estimated them."""

    displacement: Vector
    """(n,) m."""
    velocity: Vector
    """(n,) m/s."""
    force: Vector
    """(n,) N, restoring force."""
    force_std: Vector
    """(n,) N, its standard deviation."""
    displacement_std: Vector | None = None
    """(n,) m, standard deviation of the displacement; None if unknown: it then counts as exact."""
    velocity_std: Vector | None = None
    """(n,) m/s, standard deviation of the velocity; None as above."""
    force_error: ErrorSpectrum | None = None
    """N²/Hz, of the force; None if not known: then its error counts as white within the band."""
    band: tuple[float, float] | None = None
    """Hz, pass band of the accelerations from which the force was estimated; None if unknown."""


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)  # core.fitting.noise keeps the noise of each
class Observation:
    """One earthquake in one direction, for comparison with models of the layer."""

    name: str
    """Name of the earthquake, unique in a set of observations."""
    direction: Direction
    start: datetime
    """Time of the first sample, aware."""
    rate: float
    """Hz."""
    layer: LayerHistory
    conditions: Conditions
    """Other conditions of the layer; time counts from the model's reference instant."""
    ground_acceleration: Vector | None
    """(n,) m/s²; None if it was not measured."""
    accelerations: Matrix
    """(levels, n) m/s², absolute."""
    levels: tuple[str, ...]
    """Names of the levels of `accelerations`: the base slab first, then floors upwards."""
    transducer: bool
    """True if a transducer measured the displacement; an integrated displacement has no offset."""
    building: BuildingDescription | None = None
    """None where a set of earthquakes describes the building."""
    estimate: RestoringForce | None = None
    """The force as it was estimated, with its superstructure; None as above."""

    @classmethod
    def of(
        cls,
        force: ForceHistory,
        motion: MotionHistory,
        *,
        ground: ArrayLike | None = None,
        name: str = "earthquake",
        direction: Direction = "x",
        start: datetime = EPOCH,
        reference: datetime | None = None,
        across: MotionHistory | None = None,
        vertical: ArrayLike | None = None,
        temperature: float = USUAL_TEMPERATURE,
    ) -> "Observation":
        """An observation from a force and a motion that were computed from arrays.

        Args:
            force: of the isolation layer.
            motion: of the isolation layer, as many samples at the same rate.
            ground: (n,) m/s², acceleration of the ground, as many samples as the base slab's; without it nothing
                predicts the response.
            name: of the earthquake, unique among those of a building.
            direction: horizontal.
            start: time of the first sample, aware; several earthquakes need it for their order.
            reference: instant from which effects count time; None for the start.
            across: motion in the other horizontal direction; None where there is none.
            vertical: (n,) m/s², vertical acceleration of the base slab; None if it was not measured.
            temperature: °C, of the isolators.

        Raises:
            RecordError: histories have other lengths or rates, gaps, or a start without a time zone.
        """
        check_alike(force, motion)
        if across is not None:
            check_alike(force, across)
        if start.tzinfo is None:
            raise RecordError(f"the start {start} has no time zone; give it one, such as UTC")
        count, rate = force.force.size, force.rate
        later = 0.0 if reference is None else (start - reference).total_seconds()
        conditions = Conditions(
            u_cross=np.zeros(count) if across is None else across.displacement,
            v_cross=np.zeros(count) if across is None else across.velocity,
            axial_load=np.ones(count) if vertical is None else _load(force, vertical),
            temperature=np.full(count, float(temperature)),
            time=np.arange(count) / rate + later,
            ground=_shaking(None if ground is None else beside(force, "ground", ground), count, rate),
        )
        levels = tuple(channel.level for channel in force.record.channels)
        return cls(
            name=name,
            direction=direction,
            start=start,
            rate=rate,
            layer=_history(force, motion, force.band),
            conditions=conditions,
            ground_acceleration=None if ground is None else beside(force, "ground", ground),
            accelerations=force.record.samples,
            levels=levels,
            transducer=motion.is_by_transducer,
            building=force.building,
            estimate=force,
        )

    def __str__(self) -> str:
        layer, count = self.layer, self.layer.force.size
        at = int(np.argmax(np.abs(layer.displacement)))
        std = None if layer.displacement_std is None else float(layer.displacement_std[at])
        strongest = int(np.argmax(np.abs(layer.force)))
        peak, force_std = float(abs(layer.force[strongest])), float(layer.force_std[strongest])
        ground = "measured" if self.ground_acceleration is not None else "not measured"
        sentences = [
            f"{count} samples at {self.rate:g} Hz, {count / self.rate:.4g} s, from {self.start:%Y-%m-%d %H:%M:%S} UTC.",
            f"Peak displacement of the layer: {quantity(float(abs(layer.displacement[at])), 'm', std)}.",
            f"Peak restoring force: {quantity(peak, 'N', force_std)}.",
            f"Ground: {ground}. Accelerations: {', '.join(self.levels) or 'none'}.",
        ]
        return report(f"Observation of {self.name}, direction {self.direction}", sentences)


def observations(
    analysis: EventAnalysis,
    description: BuildingDescription,
    name: str | None = None,
    reference: datetime | None = None,
) -> tuple[Observation, ...]:
    """Observations of an analysed event, in every direction with a force and a motion.

    Args:
        analysis: of the event; one that was refused gives none.
        description: of the building.
        name: of the earthquake; None for the start of its record.
        reference: instant from which the conditions count time, aware; None for the start of the record.
    """
    histories = _histories(analysis)
    record, load, temperature = analysis.record, analysis.axial_load, analysis.temperature
    if record is None:
        return ()
    time = record.time + (record.start - (reference or record.start)).total_seconds()
    return tuple(
        Observation(
            name=name or f"{record.start:%Y-%m-%d %H:%M:%S}",
            direction=direction,
            start=record.start,
            rate=record.rate,
            layer=history,
            conditions=Conditions(
                u_cross=np.zeros(time.size) if cross is None else cross.displacement,
                v_cross=np.zeros(time.size) if cross is None else cross.velocity,
                axial_load=np.ones(time.size) if load is None else load.ratio,
                temperature=np.full(time.size, USUAL_TEMPERATURE if temperature is None else temperature),
                time=time,
                ground=_shaking(
                    record.find(description.ground.name, "acceleration", direction), time.size, record.rate
                ),
            ),
            ground_acceleration=record.find(description.ground.name, "acceleration", direction),
            accelerations=np.array([samples for _, samples in _measured(record, description, direction)]),
            levels=tuple(level for level, _ in _measured(record, description, direction)),
            transducer=transducer_reading(record, description, direction) is not None,
            building=description,
            estimate=analysis.directions[direction].restoring_force,
        )
        for direction, history in histories.items()
        for cross in (histories.get(CROSS[direction]),)
    )


def _histories(analysis: EventAnalysis) -> Mapping[Direction, LayerHistory]:
    return {
        direction: _history(analysed.restoring_force, analysed.motion, analysis.band)
        for direction, analysed in analysis.directions.items()
        if analysed.motion is not None
    }


def _shaking(ground: Vector | None, count: int, rate: float) -> Vector:
    """(n,) m/s², acceleration of the ground from rest; 0 where it was not measured."""
    return np.zeros(count) if ground is None else without_baseline(ground, rate)


def _load(force: ForceHistory, vertical: ArrayLike) -> Vector:
    """(n,) vertical force over weight, 1 at rest."""
    return np.asarray(1 + band_passed(beside(force, "vertical", vertical), force.rate, force.band) / GRAVITY)


def _history(force: RestoringForce, motion: MeasuredMotion, band: tuple[float, float] | None) -> LayerHistory:
    return LayerHistory(
        displacement=motion.displacement,
        velocity=motion.velocity,
        force=force.force,
        force_std=force.fitting_std,
        displacement_std=motion.fitting_std[0],
        velocity_std=motion.fitting_std[1],
        force_error=force.error,
        band=band,
    )


def _measured(record: Record, description: BuildingDescription, direction: Direction) -> tuple[tuple[str, Vector], ...]:
    levels = (description.base, *description.floors)
    channels = ((level.name, record.find(level.name, "acceleration", direction)) for level in levels)
    return tuple((name, samples) for name, samples in channels if samples is not None)


def excitation_by(observation: Observation) -> Excitation:
    """Prescribed motion of a model by an observation's; computed once for as long as the observation exists.

    Raises:
        ModelError: arrays differ in length.
    """
    known = _KNOWN.get(observation)
    if known is None:
        layer = observation.layer
        known = excitation(layer.displacement, layer.velocity, observation.rate, observation.conditions)
        _KNOWN[observation] = known
    return known


_KNOWN: WeakKeyDictionary[Observation, Excitation] = WeakKeyDictionary()
"""By identity: every model of a diagnosis is driven by the same ones."""
