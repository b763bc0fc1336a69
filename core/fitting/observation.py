"""What was measured of the isolation layer in one earthquake and one direction?"""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from core.analysis import EventAnalysis
from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.model.isolator import Conditions
from core.record import Direction, Record
from core.restoring_force.error_spectrum import ErrorSpectrum
from core.restoring_force.estimator import RestoringForce
from core.sensors.integrated_channel import transducer_reading

USUAL_TEMPERATURE = 20.0
"""°C, where none was measured."""
CROSS: Mapping[Direction, Direction] = {"x": "y", "y": "x"}


@dataclass(frozen=True, slots=True, eq=False)
class LayerHistory:
    """What an analysis estimated of the layer in one direction."""

    displacement: Vector
    """(n,) m."""
    velocity: Vector
    """(n,) m/s."""
    force: Vector
    """(n,) N, restoring force."""
    force_std: Vector
    """(n,) N, its standard deviation."""
    displacement_std: Vector | None = None
    """(n,) m, standard deviation of the displacement; None where nobody told: then it is taken for exact."""
    velocity_std: Vector | None = None
    """(n,) m/s, of the velocity; None as above."""
    force_error: ErrorSpectrum | None = None
    """N²/Hz, of the force; None where nobody told: then its error is taken for white within the band."""
    band: tuple[float, float] | None = None
    """Hz, that the accelerations had passed from which the force was estimated; None where nobody told."""


@dataclass(frozen=True, slots=True, eq=False)
class Observation:
    """One earthquake in one direction, as a model of the layer is held against it."""

    name: str
    """Of the earthquake: unique among those that are looked at together."""
    direction: Direction
    start: datetime
    """Time of the first sample, aware."""
    rate: float
    """Hz."""
    layer: LayerHistory
    conditions: Conditions
    """What else acted on the layer; its time is counted from the model's reference instant."""
    ground_acceleration: Vector | None
    """(n,) m/s²; None where nothing measured it."""
    accelerations: Matrix
    """(levels, n) m/s², absolute."""
    levels: tuple[str, ...]
    """Names of the levels of `accelerations`: the base slab first, then floors upwards."""
    transducer: bool
    """Whether a transducer measured the displacement; else it was integrated and knows no offset."""
    building: BuildingDescription | None = None
    """None where a set of earthquakes describes the building."""
    estimate: RestoringForce | None = None
    """The force as it was estimated, with its superstructure; None as above."""


def observations(
    analysis: EventAnalysis, description: BuildingDescription, name: str, reference: datetime
) -> tuple[Observation, ...]:
    """Of an analysed event, in every direction in which force and motion are known.

    Args:
        analysis: of the event; one that was refused gives none.
        description: of the building.
        name: of the earthquake.
        reference: instant from which the conditions count time, aware.
    """
    histories = _histories(analysis)
    record, load, temperature = analysis.record, analysis.axial_load, analysis.temperature
    if record is None:
        return ()
    time = record.time + (record.start - reference).total_seconds()
    return tuple(
        Observation(
            name=name,
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
            ),
            ground_acceleration=record.find(description.ground.name, "acceleration", direction),
            accelerations=np.array([samples for _, samples in _measured(record, description, direction)]),
            levels=tuple(level for level, _ in _measured(record, description, direction)),
            transducer=transducer_reading(record, description, direction) is not None,
        )
        for direction, history in histories.items()
        for cross in (histories.get(CROSS[direction]),)
    )


def _histories(analysis: EventAnalysis) -> Mapping[Direction, LayerHistory]:
    return {
        direction: LayerHistory(
            displacement=found.motion.displacement,
            velocity=found.motion.velocity,
            force=found.restoring_force.force,
            force_std=found.restoring_force.fitting_std,
            displacement_std=found.motion.fitting_std[0],
            velocity_std=found.motion.fitting_std[1],
            force_error=found.restoring_force.error,
            band=analysis.band,
        )
        for direction, found in analysis.directions.items()
        if found.motion is not None
    }


def _measured(record: Record, description: BuildingDescription, direction: Direction) -> tuple[tuple[str, Vector], ...]:
    levels = (description.base, *description.floors)
    found = ((level.name, record.find(level.name, "acceleration", direction)) for level in levels)
    return tuple((name, samples) for name, samples in found if samples is not None)
