"""A stored version and its events, as the workbench takes them: a model file, and earthquakes."""

from collections.abc import Sequence
from typing import cast

from core.workbench.earthquakes import Earthquakes, joined
from service.models.inputs import WorkInputs
from service.models.model_file import Directions, ModelFile
from service.models.work import Observed


def given(inputs: WorkInputs) -> ModelFile:
    """The version as a file would have it."""
    direction = cast(Directions, inputs.direction)
    return ModelFile(inputs.description.code, direction, inputs.isolator, inputs.reference)


def records(inputs: WorkInputs, seen: Sequence[Observed]) -> Earthquakes:
    """The wanted events, held-out and unusable ones among them, in order of time.

    Before the first the layer is taken to be new.
    """
    wanted = sorted((one for one in seen if one.event.is_wanted), key=lambda one: one.event.start)
    return joined(
        [one.earthquake for one in wanted],
        inputs.description,
        inputs.band,
        reference=inputs.reference,
        held_out=[one.event.name for one in wanted if one.event.is_held_out],
    )
