"""The whole chain for one event: the one function that the worker calls."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

from core.arrays import Vector
from core.equivalent import EquivalentSegment
from core.estimator import RestoringForce
from core.quality import Finding
from core.record import Direction


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
