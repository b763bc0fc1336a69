"""Results of an analysis as a document: stored rows in the schema of the API, and the file of `menshin analyse`.

The file holds the row that the service would store, so that both have one shape.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from core.analysis import AnalysisSettings, EventAnalysis
from core.description import BuildingDescription
from core.shaking.classes import long_period_class
from core.shaking.measures import SPECTRUM_PERIODS
from service.analyses import store
from service.analyses.schema import (
    AssessmentOut,
    CycleOut,
    DirectionOut,
    FileResults,
    FindingOut,
    LayerOut,
    ModeOut,
    PeakOut,
    SensorOut,
    ShakingOut,
)
from service.analyses.tables import Analysis, DirectionResult, LayerResult, ShakingResult
from service.schema import Answer, json_values

REASONS: Mapping[str, str] = {
    "shear_strain": "the building file gives no isolation.rubber_height",
    "frequency_std": "the estimator gives none",
    "damping_ratio_std": "the estimator gives none",
    "shape_std": "noise of the base slab's record could not be allowed for",
    "misfit": "there was no fit that allows for noise of the base slab's record",
    "estimator": "the event was refused",
    "pga": "no horizontal acceleration of the ground was measured",
    "temperature": "no thermometer is described, or none was recorded",
    "noise": "the record is too short to know it",
    "gain": "no other sensor determines it",
    "gain_std": "no other sensor determines it",
    "refusal": "the event was not refused",
    "assessment": "the estimator does not assess itself",
    "chi_square": "no superstructure was needed, or none was found",
    "fallback": "the estimate is its own",
    "settings.sensors": "every instrumented level was used",
    "layer": "neither a path in plan nor torsion nor a vertical load is known",
    "peak_resultant": "there is no path in plan unless the displacement is known in x and y",
    "peak_torsion": "the positions of the sensors do not determine the torsion",
    "peak_torsion_std": "the positions of the sensors do not determine the torsion",
    "torsion_lowest_frequency": "the positions of the sensors do not determine the torsion",
    "axial_load_level": "no channel measures a vertical acceleration",
    "lowest_axial_load": "no channel measures a vertical acceleration",
    "highest_axial_load": "no channel measures a vertical acceleration",
    "peak_displacement": "no channel measures the displacement of the isolation layer",
    "peak_displacement_std": "no channel measures the displacement of the isolation layer",
    "lowest_frequency": "no channel measures the displacement of the isolation layer",
    "highest_frequency": "no channel measures the displacement of the isolation layer",
    "residual_displacement": "no transducer measures the displacement, and an integral has no residual",
    "residual_displacement_std": "no transducer measures the displacement, and an integral has no residual",
    "shaking": "no horizontal acceleration was recorded",
    "intensity": "the record shows no motion",
    "std": "nothing determines the error of the estimate",
    "direction": "the channel has no direction",
    "channel": "the finding is of no single channel",
    "value": "the finding has no number",
}
"""Reasons for a null, by the name of the value."""
UNDETERMINED = "the record does not determine it"


def file_results(
    event: EventAnalysis, description: BuildingDescription, settings: AnalysisSettings, verdict: Answer
) -> dict[str, Any]:
    """An event that was analysed from files, as values of JSON."""
    row = store.row(event, description, settings)
    directions = [direction_out(one, len(one.cycles)) for one in row.directions]
    written = FileResults.model_validate(
        results(row, description)
        | {name: getattr(row, name) for name in ("version", "estimator", "settings", "refusal", "pga", "temperature")}
        | {
            "building": description.code,
            "start": event.start,
            "rate": event.rate,
            "verdict": verdict,
            "directions": directions,
            "layer": layer_out(row.layer),
            "shaking": shaking_out(row.shaking),
            "estimators": {name: one.restoring_force.estimator for name, one in event.directions.items()},
            "cycles": [
                CycleOut(direction=one.direction, **_columns(cycle, CycleOut, "direction"))
                for one in row.directions
                for cycle in one.cycles
            ],
            "missing": {},
        }
    )
    values: dict[str, Any] = json_values(written.model_dump(mode="json"))
    without_verdict = {name: value for name, value in values.items() if name != "verdict"}
    return values | {"missing": dict(_missing(without_verdict, ""))}


def results(analysis: Analysis, description: BuildingDescription) -> dict[str, Any]:
    """Quality findings, peaks and sensors of an analysis."""
    return {
        "quality": [FindingOut.model_validate(finding) for finding in analysis.quality],
        "peaks": peaks(analysis, description),
        "sensors": [SensorOut(**_columns(sensor, SensorOut)) for sensor in analysis.sensors],
    }


def peaks(analysis: Analysis, description: BuildingDescription) -> list[PeakOut]:
    """Peaks by channel, with each channel's level, quantity and direction."""
    known = {channel.id: channel for channel in description.channels}
    return [
        PeakOut(
            channel=channel,
            level=known[channel].level if channel in known else None,
            quantity=known[channel].quantity if channel in known else None,
            direction=known[channel].direction if channel in known else None,
            peak=json_values(peak),
        )
        for channel, peak in sorted(analysis.peaks.items())
    ]


def direction_out(result: DirectionResult, cycles: int) -> DirectionOut:
    """Results in one direction, with its number of cycles."""
    return DirectionOut(
        **_columns(result, DirectionOut, "assessment", "cycles", "modes"),
        assessment=None if result.assessment is None else AssessmentOut(**json_values(result.assessment)),
        cycles=cycles,
        modes=[ModeOut(**_columns(mode, ModeOut)) for mode in result.modes],
    )


def layer_out(result: LayerResult | None) -> LayerOut | None:
    """Results across the directions."""
    return None if result is None else LayerOut(**_columns(result, LayerOut))


def shaking_out(result: ShakingResult | None) -> ShakingOut | None:
    """Strength of the shaking, with the periods of its spectrum."""
    if result is None:
        return None
    return ShakingOut(
        **_columns(result, ShakingOut, "periods", "long_period_class"),
        periods=SPECTRUM_PERIODS.tolist(),
        long_period_class=long_period_class(result.long_period_velocity),
    )


def _columns(row: object, model: type[Answer], *others: str) -> dict[str, Any]:
    """Columns of a row that are fields of a model, but for some; None for a number that JSON does not have."""
    return {name: json_values(getattr(row, name)) for name in model.model_fields if name not in others}


def _missing(value: Any, path: str) -> Iterator[tuple[str, str]]:  # noqa: ANN401  any value of JSON
    """The path of every null, and its reason."""
    match value:
        case None:
            place = path.removeprefix(".")
            yield place, REASONS.get(place, REASONS.get(place.rpartition(".")[2], UNDETERMINED))
        case dict():
            for key, member in value.items():
                yield from _missing(member, f"{path}.{key}")
        case list():
            for index, member in enumerate(value):
                yield from _missing(member, f"{path}[{index}]")
