"""What does a model predict of several earthquakes, and of which can it not?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from core.building import FixedBaseModes
from core.comparison.compared import Band, ForceComparison
from core.comparison.prediction import UNDRIVEN, Prediction, Start, predict
from core.description import BuildingDescription
from core.effects import EFFECTS
from core.errors import CoreError
from core.model.isolator import Isolator
from core.record import Direction


@dataclass(frozen=True, slots=True, eq=False)
class Predictions:
    """Driven by the ground alone."""

    each: tuple[Prediction, ...]
    """In order of time, of the earthquakes and directions in which that is possible."""
    remarks: tuple[str, ...]
    """Where it is not, and why; where the model is told more of an earthquake than its ground motion."""


def predict_all(
    forces: Sequence[ForceComparison],
    superstructures: Mapping[Direction, FixedBaseModes],
    isolator: Isolator,
    description: BuildingDescription,
    band: Band,
) -> Predictions:
    """Every earthquake, both directions of it together where the model is of both and both can be predicted.

    Args:
        forces: what was measured, and the states of the model before.
        superstructures: all modes in each direction that is known.
        isolator: the model.
        description: of the building.
        band: Hz.
    """
    starts = _starts(forces, superstructures)
    each: list[Prediction] = []
    remarks = [_called(one) + UNDRIVEN for one in forces if one.observation.ground_acceleration is None]
    for directions in starts.values():
        try:
            each += predict(directions, isolator, description, band)
        except CoreError as error:
            remarks.append(f"{directions[0].observation.name}: {error}")
    if any({"u_cross", "v_cross"} & {*EFFECTS[name].needs} for name in isolator.effects):
        remarks += [
            f"{directions[0].observation.name}: motion in the other direction is given as measured, not predicted"
            for directions in starts.values()
            if len(directions) == 1
        ]
    return Predictions(tuple(each), tuple(remarks))


def _starts(
    forces: Sequence[ForceComparison], superstructures: Mapping[Direction, FixedBaseModes]
) -> dict[datetime, list[Start]]:
    """By earthquake, in order of time."""
    starts: dict[datetime, list[Start]] = {}
    for one in sorted(forces, key=lambda one: one.observation.start):
        seen = one.observation
        if seen.ground_acceleration is not None and seen.direction in superstructures:
            starts.setdefault(seen.start, []).append(Start(superstructures[seen.direction], seen, one.states))
    return starts


def _called(one: ForceComparison) -> str:
    return f"{one.observation.name}, direction {one.observation.direction}: "
