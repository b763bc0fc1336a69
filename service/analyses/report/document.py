"""An analysed event as JSON: SI units, times in UTC, and null with a reason for what is missing."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from math import isfinite
from typing import Any

import numpy as np

from core.analysis import AnalysisSettings, DirectionAnalysis, EventAnalysis
from core.arrays import Vector
from core.description import BuildingDescription
from core.identification.modes import Mode
from core.isolation_layer.layer import AxialLoad
from core.isolation_layer.motion import MeasuredMotion
from service.version import VERSION

REASONS: Mapping[str, str] = {
    "shear_strain": "the building file gives no isolation.rubber_height",
    "frequency_std": "the estimator gives none",
    "damping_ratio_std": "the estimator gives none",
    "shape_std": "noise of the base slab's record could not be allowed for",
    "misfit": "there was no fit that allows for noise of the base slab's record",
    "pga": "no horizontal acceleration of the ground was measured",
    "temperature": "no thermometer is described, or none was recorded",
    "noise": "the record is too short to know it",
    "gain": "no other sensor determines it",
    "gain_std": "no other sensor determines it",
    "refusal": "the event was not refused",
    "reliance": "the estimator does not assess itself",
    "chi_square": "no superstructure was needed, or none was found",
    "fallback": "the estimate is its own",
    "sensors": "every instrumented level was used",
    "motion": "no channel measures the displacement of the isolation layer",
    "peak_resultant": "there is no path in plan unless the displacement is known in x and y",
    "torsion": "the positions of the sensors do not determine the torsion",
    "axial_load": "no channel measures a vertical acceleration",
    "residual": "no transducer measures the displacement, and an integral of accelerations has no residual",
    "channel": "the finding is of no single channel",
    "value": "the finding has no number",
}
"""Reasons for a null, by the name of the value."""
UNDETERMINED = "the record does not determine it"


def as_json(event: EventAnalysis, description: BuildingDescription, settings: AnalysisSettings) -> dict[str, Any]:
    """The event as values of JSON; `missing` gives the reason of every null by its path."""
    document: dict[str, Any] = {
        "building": description.code,
        "start": event.start.isoformat(),
        "rate": event.rate,
        "version": VERSION,
        "settings": asdict(settings),
        "refusal": event.refusal,
        "pga": event.pga,
        "temperature": event.temperature,
        "peaks": dict(event.peaks),
        "sensor_health": [asdict(sensor) for sensor in event.sensors],
        "peak_resultant": event.peak_resultant,
        "torsion": None if event.torsion is None else _motion(event.torsion),
        "axial_load": None if event.axial_load is None else _load(event.axial_load),
        "directions": {name: _direction(found, description) for name, found in event.directions.items()},
        "quality": [asdict(finding) for finding in event.quality],
    }
    finite = _finite(document)
    return {**finite, "missing": dict(_missing(finite, ""))}


def _direction(found: DirectionAnalysis, description: BuildingDescription) -> dict[str, Any]:
    force = found.restoring_force
    peak, std = force.peak
    return {
        "superstructure": {"modes": [_mode(mode, description) for mode in force.modes]},
        "restoring_force": {
            "estimator": force.estimator,
            "peak": peak,
            "std": std,
            "reliance": None if force.assessment is None else asdict(force.assessment),
        },
        "motion": None if found.motion is None else _motion(found.motion),
        "equivalent": [asdict(segment) for segment in found.equivalent],
    }


def _motion(motion: MeasuredMotion) -> dict[str, Any]:
    peak, std = motion.peak
    return {
        "peak": peak,
        "peak_std": std,
        "source": "integrated from accelerations" if motion.is_integrated else "measured by a transducer",
        "band": motion.band,
        "residual": None if motion.residual is None else asdict(motion.residual),
    }


def _load(load: AxialLoad) -> dict[str, Any]:
    return {"level": load.level, "lowest": float(load.ratio.min()), "highest": float(load.ratio.max())}


def _mode(mode: Mode, description: BuildingDescription) -> dict[str, Any]:
    return {
        "frequency": mode.frequency,
        "frequency_std": mode.frequency_std,
        "damping_ratio": mode.damping_ratio,
        "damping_ratio_std": mode.damping_ratio_std,
        "shape": _by_level(mode.shape, description),
        "shape_std": None if mode.shape_std is None else _by_level(mode.shape_std, description),
        "misfit": mode.misfit,
    }


def _by_level(values: Vector, description: BuildingDescription) -> dict[str, float]:
    return {level.name: value for level, value in zip(description.floors, values.tolist(), strict=True)}


def _finite(value: Any) -> Any:  # noqa: ANN401  any value of JSON
    """The value with None for every number that JSON does not have."""
    match value:
        case float() | np.floating():
            return float(value) if isfinite(value) else None
        case Mapping():
            return {key: _finite(member) for key, member in value.items()}
        case str():
            return value
        case Sequence():
            return [_finite(member) for member in value]
    return value


def _missing(value: Any, path: str) -> Iterator[tuple[str, str]]:  # noqa: ANN401  any value of JSON
    """The path of every null, and its reason."""
    match value:
        case None:
            yield path.removeprefix("."), REASONS.get(path.rpartition(".")[2], UNDETERMINED)
        case dict():
            for key, member in value.items():
                yield from _missing(member, f"{path}.{key}")
        case list():
            for index, member in enumerate(value):
                yield from _missing(member, f"{path}[{index}]")
