"""What does a model answer to records: driven by the measured motion, and by the ground alone?"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from core.comparison import ForceComparison, compare_forces
from core.errors import CoreError
from core.isolator import Isolator
from core.known_superstructure import KnownSuperstructure
from core.prediction import Prediction, predict
from core.record import Direction
from service.workbench.records import Records


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


def answers(isolator: Isolator, records: Records) -> Answers:
    """To all records, those left out among them: what the layer keeps passes through every earthquake.

    Raises:
        ModelError: the model's force grew beyond all bounds.
    """
    forces = compare_forces(isolator, records.observations, records.band)
    known = {direction: records.superstructure(direction) for direction in _directions(forces)}
    predictions: list[Prediction] = []
    remarks = [
        f"direction {direction}: {one.source if isinstance(one, KnownSuperstructure) else one}"
        for direction, one in known.items()
    ]
    for force in forces:
        one = known[force.observation.direction]
        if isinstance(one, str):
            continue
        try:
            predictions.append(
                predict(one.modes, isolator, force.observation, records.description, records.band, force.states)
            )
        except CoreError as error:
            remarks.append(str(error))
    return Answers(forces, tuple(predictions), tuple(remarks))


def _directions(forces: Sequence[ForceComparison]) -> list[Direction]:
    return sorted({force.observation.direction for force in forces})
