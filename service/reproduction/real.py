"""Section 8: the paper's steps on the records of a real building."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from core.analysis import AnalysisSettings, DirectionAnalysis, analyse
from core.arrays import Matrix, Vector
from core.description import BuildingDescription
from core.errors import RecordError
from core.estimators import ESTIMATORS, cms
from core.estimators.superstructure import InstrumentedSuperstructure, instrumented_superstructure
from core.record import Direction, Record
from core.sensors.preparation import prepared
from service.records.event_files import EventFiles
from service.reproduction.simulated import identified_shapes, modal_accelerations


@dataclass(frozen=True, slots=True, eq=False)
class RealEvent:
    """One earthquake, in one direction."""

    start: datetime
    """Start of every history."""
    rate: float
    """Hz, of every history."""
    pga: float | None
    """m/s²."""
    superstructure: InstrumentedSuperstructure
    """Input of the estimators."""
    by_estimator: Mapping[str, DirectionAnalysis]
    """By the paper's always."""
    modal: Matrix
    """(MODES or fewer, n) m/s² kg^(1/2), modal accelerations of the modes that CMS identified (eq 23)."""
    truth: Vector | None
    """(n,) N, F = -Σ m_i a_i; None unless every level was recorded."""

    @property
    def time(self) -> Vector:
        """(n,) s."""
        return np.arange(self.superstructure.base_acceleration.size) / self.rate


@dataclass(frozen=True, slots=True, eq=False)
class RealBuilding:
    """Section 8."""

    description: BuildingDescription
    direction: Direction
    sensors: tuple[str, ...]
    """Names of the levels that the estimators were given, the base slab first."""
    events: tuple[RealEvent, ...]
    """Earliest first; at least one."""
    refused: tuple[str, ...]
    """Unusable events, with reasons."""

    @property
    def strongest(self) -> RealEvent:
        """The event with the largest acceleration of the base slab."""
        return max(self.events, key=lambda event: float(np.abs(event.superstructure.base_acceleration).max()))

    @property
    def middle(self) -> int:
        """Index of the floor that corresponds to the paper's fourth storey."""
        return int(self.events[0].superstructure.measured[0])


def papers_sensors(description: BuildingDescription, direction: Direction) -> tuple[str, ...]:
    """The base slab, the instrumented floor next to the middle, and the topmost one, as the paper has them."""
    accelerometers = {c.level for c in description.channels if (c.quantity, c.direction) == ("acceleration", direction)}
    floors = [level.name for level in description.floors if level.name in accelerometers]
    inner = floors[:-1]
    return (description.base.name, *inner[len(inner) // 2 : len(inner) // 2 + 1], *floors[-1:])


def real(
    events: Sequence[EventFiles],
    description: BuildingDescription,
    sensors: tuple[str, ...] | None,
    settings: AnalysisSettings,
    report_step: Callable[[str], None],
) -> RealBuilding:
    """Section 8 on a building's records, in the first direction in which its base slab is measured.

    Args:
        events: its records.
        description: of it.
        sensors: names of the levels to use; None for those of `papers_sensors`.
        settings: rate and band.
        report_step: called with the next step.

    Raises:
        RecordError: no event can be used.
    """
    if not description.horizontal_directions:
        raise RecordError("no horizontal acceleration of the base slab is described")
    direction = description.horizontal_directions[0]
    chosen = replace(settings, sensors=sensors or papers_sensors(description, direction))
    usable, refused = [], []
    for event in events:
        report_step(f"analysing the event of {event.start:%Y-%m-%d %H:%M:%S}")
        result = _event(event, description, direction, chosen)
        if isinstance(result, str):
            refused.append(f"{event.start:%Y-%m-%d %H:%M:%S}: {result}")
        else:
            usable.append(result)
    if not usable:
        raise RecordError("; ".join(refused) or "the files hold no event")
    return RealBuilding(description, direction, chosen.sensors or (), tuple(usable), tuple(refused))


def _event(
    event: EventFiles, description: BuildingDescription, direction: Direction, settings: AnalysisSettings
) -> RealEvent | str:
    """Result, or the reason why there is none."""
    analyses = {name: analyse(event.segments, description, replace(settings, estimator=name)) for name in ESTIMATORS}
    first = analyses[cms.NAME]
    by_estimator = {name: a.directions[direction] for name, a in analyses.items() if direction in a.directions}
    record = prepared(event.segments, description, settings.rate).record
    if record is None or cms.NAME not in by_estimator:
        return first.refusal or f"nothing could be estimated in direction {direction}"
    superstructure = instrumented_superstructure(record, description, direction, settings.sensors, settings.band)
    shapes = identified_shapes(superstructure, by_estimator[cms.NAME].restoring_force)
    return RealEvent(
        start=first.start,
        rate=first.rate,
        pga=first.pga,
        superstructure=superstructure,
        by_estimator=by_estimator,
        modal=modal_accelerations(superstructure, shapes),
        truth=_inertia(record, description, direction, settings.band),
    )


def _inertia(
    record: Record, description: BuildingDescription, direction: Direction, band: tuple[float, float]
) -> Vector | None:
    """F = -Σ m_i a_i where every level above the isolators was recorded."""
    whole = instrumented_superstructure(record, description, direction, None, band)
    if whole.measured.size < len(description.floors):
        return None
    force: Vector = -description.base_mass * whole.base_acceleration - description.floor_mass @ whole.floor_acceleration
    return force
