"""A model held against records: every comparison, and where it fails."""

from dataclasses import dataclass

import numpy as np

from core.comparison.block_corrections import BlockCorrection, block_corrections
from core.comparison.failure import Failure, failure
from core.comparison.failure_words import words
from service.jobs.progress import Tell
from service.models.model_file import ModelFile
from service.models.workbench.answers import Answers, answers
from service.models.workbench.records import Records

SEED = 1
"""Of the intervals: the same records give the same page."""


@dataclass(frozen=True, slots=True, eq=False)
class Held:
    """What came of it."""

    model: ModelFile
    records: Records
    answers: Answers
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
    tell("driving the model by the measured motion and by the ground alone", 0, 2)
    answered = answers(model.isolator, records)
    tell("looking at where it fails", 1, 2)
    found = failure(answered.forces, records.band, np.random.default_rng(SEED))
    corrections = block_corrections(model.isolator, answered.forces)
    tell("compared", 2, 2)
    return Held(model, records, answered, found, words(found), corrections)
