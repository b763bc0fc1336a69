"""A model held against records: every comparison, and where it fails."""

from dataclasses import dataclass

import numpy as np

from core.block_corrections import BlockCorrection, block_corrections
from core.comparison import ForceComparison, compare_forces
from core.errors import CoreError
from core.failure import Failure, failure
from core.failure_words import words
from core.known_superstructure import KnownSuperstructure
from core.prediction import Prediction, predict
from service.model_file import ModelFile
from service.workbench.records import Records, Tell

SEED = 1
"""Of the intervals: the same records give the same page."""


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """What came of it."""

    model: ModelFile
    records: Records
    forces: tuple[ForceComparison, ...]
    """Driven by the measured motion, in order of time."""
    predictions: tuple[Prediction, ...]
    """Driven by the ground alone, of the earthquakes in which that is possible."""
    remarks: tuple[str, ...]
    """What an engineer should know of how the predictions were made, and why some were not."""
    failure: Failure
    text: tuple[str, ...]
    """Where it fails, in sentences."""
    corrections: tuple[BlockCorrection, ...]


def held(model: ModelFile, records: Records, tell: Tell) -> Held:
    """The model held against all records.

    Args:
        model: of the building's layer.
        records: of the building.
        tell: for who waits.

    Raises:
        RecordError: no record can be used.
        ModelError: the model's force grew beyond all bounds.
    """
    tell("driving the model by the measured motion", 0, 3)
    forces = compare_forces(model.isolator, records.observations, records.band)
    found = failure(forces, records.band, np.random.default_rng(SEED))
    tell("driving it by the ground alone", 1, 3)
    predictions, remarks = _predicted(model, records, forces)
    tell("looking at every block", 2, 3)
    corrections = block_corrections(model.isolator, forces)
    tell("compared", 3, 3)
    return Held(model, records, forces, predictions, remarks, found, words(found), corrections)


def _predicted(
    model: ModelFile, records: Records, forces: tuple[ForceComparison, ...]
) -> tuple[tuple[Prediction, ...], tuple[str, ...]]:
    known = {direction: records.superstructure(direction) for direction in model.directions}
    predictions: list[Prediction] = []
    remarks = [
        f"direction {direction}: {one.source if isinstance(one, KnownSuperstructure) else one}"
        for direction, one in known.items()
        if any(force.observation.direction == direction for force in forces)
    ]
    for force in forces:
        one = known[force.observation.direction]
        if isinstance(one, str):
            continue
        try:
            predictions.append(
                predict(one.modes, model.isolator, force.observation, records.description, records.band, force.states)
            )
        except CoreError as error:
            remarks.append(str(error))
    return tuple(predictions), tuple(remarks)
