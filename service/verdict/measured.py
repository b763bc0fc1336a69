"""The displacement of the isolators with its uncertainty, and the assessment of an analysis outside a database."""

from collections.abc import Iterable, Mapping, Sequence
from math import hypot, sqrt
from typing import TYPE_CHECKING, TypedDict

from core.description import BuildingDescription
from service.buildings.description import GivenLimits
from service.verdict import shaking
from service.verdict.assessment import Assessment, Facts, assess
from service.verdict.checks import COVERAGE, Lacking, Measured

if TYPE_CHECKING:
    from core.analysis import EventAnalysis

DIRECTIONS = ("x", "y")
NO_DISPLACEMENT = Lacking(
    reason="Nothing measured how far the isolators moved.",
    remedy="A displacement transducer on the isolators, or an accelerometer on the ground.",
)
NO_RESIDUAL = Lacking(
    reason="No displacement transducer measured where the isolators came to rest.",
    remedy="A displacement transducer, or a survey of the isolators' position.",
)
NOT_COMPARED = Lacking(
    reason="This earthquake has not been compared with earlier ones.",
    remedy="A usable record of the isolators' force and displacement.",
)

NOT_SUMMED = Lacking(
    reason="The earthquakes before this one are not known.",
    remedy="The verdict of the service, which stores every earthquake.",
)
OF_SENSORS = frozenset(
    {"clipping", "dead", "incoherent", "missing", "neighbour", "offset", "reversed", "rotation", "spike", "swapped"}
    | {"unit"}
)
OF_CLOCKS = frozenset({"clock", "delay"})
"""Kinds of findings about single sensors, and about clocks; the others are about the record."""


class Problems(TypedDict):
    """Findings by the check that they belong to."""

    data_problems: tuple[str, ...] | Lacking
    sensor_problems: tuple[str, ...] | Lacking
    clock_problems: tuple[str, ...] | Lacking


def problems(findings: Iterable[tuple[str, str]]) -> Problems:
    """Findings that weaken a verdict, (kind, text) each, by the check that they belong to."""
    every = list(findings)
    return Problems(
        data_problems=tuple(text for kind, text in every if kind not in OF_SENSORS | OF_CLOCKS),
        sensor_problems=tuple(text for kind, text in every if kind in OF_SENSORS),
        clock_problems=tuple(text for kind, text in every if kind in OF_CLOCKS),
    )


def of_analysis(
    event: "EventAnalysis", description: BuildingDescription, limits: Mapping[str, GivenLimits]
) -> Assessment:
    """The assessment of files: without earlier earthquakes or alerts, so that what needs them is undecided."""
    moved = {name: direction.motion for name, direction in event.directions.items() if direction.motion is not None}
    left: dict[str, tuple[float, float | None]] = {
        name: (motion.residual.value, motion.residual.std)
        for name, motion in moved.items()
        if motion.residual is not None
    }
    peaks: dict[str, tuple[float, float | None]] = {name: motion.peak for name, motion in moved.items()}
    return assess(
        Facts(
            unusable="" if event.refusal is None else f"Its records cannot be used: {event.refusal}",
            layer=description.isolation,
            limits=limits,
            shaking=shaking.of_analysis(event, description),
            displacement=measured_displacement(peaks, event.peak_resultant),
            residual=measured_residual(left),
            rest_position=NOT_SUMMED,
            travel=NOT_SUMMED,
            largest_earlier=None,
            stiffness=dict.fromkeys(description.horizontal_directions, NOT_COMPARED),
            **problems(
                (one.kind, " ".join(filter(None, (one.channel, one.message))))
                for one in event.quality
                if one.severity != "note"
            ),
            alerts=(),
        )
    )


def measured_displacement(
    peaks: Mapping[str, tuple[float, float | None]], resultant: float | None
) -> Measured | Lacking:
    """m, largest displacement in plan, of the largest by direction, each with its standard deviation.

    With one direction alone it is a lower bound.
    """
    if not peaks:
        return NO_DISPLACEMENT
    lacking = [direction for direction in DIRECTIONS if direction not in peaks]
    if not lacking and resultant is not None:
        return Measured(value=resultant, uncertainty=_uncertainty([std for _, std in peaks.values()]))
    value, std = max(peaks.values(), key=lambda one: abs(one[0]))
    return Measured(
        value=value,
        uncertainty=_uncertainty([std]),
        doubt=f"The displacement in direction {lacking[0]} is not known." if lacking else "It is not known in plan.",
        remedy=f"Usable sensors in direction {lacking[0]}." if lacking else "",
    )


def measured_residual(left: Mapping[str, tuple[float, float | None]]) -> Measured | Lacking:
    """m, residual displacement in plan, of that by direction, each with its standard deviation."""
    if not left:
        return NO_RESIDUAL
    lacking = [direction for direction in DIRECTIONS if direction not in left]
    return Measured(
        value=hypot(*(value for value, _ in left.values())),
        uncertainty=_uncertainty([std for _, std in left.values()]),
        doubt=f"The residual displacement in direction {lacking[0]} is not known." if lacking else "",
        remedy=f"A displacement transducer in direction {lacking[0]}." if lacking else "",
    )


def _uncertainty(stds: Sequence[float | None]) -> float | None:
    """95 %, of a length in plan: as large as it may be, however the errors of the directions go together."""
    known = [std for std in stds if std is not None]
    return COVERAGE * sqrt(sum(std**2 for std in known)) if len(known) == len(stds) else None
