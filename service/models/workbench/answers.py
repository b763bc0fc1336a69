"""What does a model answer to records: driven by the measured motion, and by the ground alone?"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from core.comparison.compared import ForceComparison, compare_forces
from core.comparison.prediction import Prediction
from core.comparison.predictions import predict_all
from core.model.isolator import Isolator
from core.record import Direction
from service.models.workbench.records import Records


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """Of one model to all records."""

    forces: tuple[ForceComparison, ...]
    """Driven by the measured motion, in order of time."""
    predictions: tuple[Prediction, ...]
    """Driven by the ground alone, of the earthquakes in which that is possible."""
    remarks: tuple[str, ...]
    """What an engineer should know of how the predictions were made, and why some were not."""

    def of(self, names: Collection[str]) -> "Answers":
        """To the earthquakes of these names only."""
        return replace(
            self,
            forces=tuple(one for one in self.forces if one.observation.name in names),
            predictions=tuple(one for one in self.predictions if one.observation.name in names),
        )

    def along(self, direction: Direction) -> "Answers":
        """In one direction only."""
        return replace(
            self,
            forces=tuple(one for one in self.forces if one.observation.direction == direction),
            predictions=tuple(one for one in self.predictions if one.observation.direction == direction),
        )


def answers(isolator: Isolator, records: Records) -> Answers:
    """To all records, those left out among them: what the layer keeps passes through every earthquake.

    Raises:
        ModelError: the model's force grew beyond all bounds.
    """
    forces = compare_forces(isolator, records.observations, records.band)
    known = {direction: records.superstructure(direction) for direction in _directions(forces)}
    modes = {direction: one.modes for direction, one in known.items() if not isinstance(one, str)}
    found = predict_all(forces, modes, isolator, records.description, records.band)
    sources = [
        f"direction {direction}: {one if isinstance(one, str) else one.source}" for direction, one in known.items()
    ]
    return Answers(forces, found.each, (*sources, *found.remarks))


def _directions(forces: Sequence[ForceComparison]) -> list[Direction]:
    return sorted({force.observation.direction for force in forces})
