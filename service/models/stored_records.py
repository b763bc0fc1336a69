"""A version and the events it is held against, as the workbench takes them: a model file, and records."""

from collections.abc import Sequence
from typing import cast

from service.models.inputs import WorkInputs
from service.models.model_file import Directions, ModelFile
from service.models.work import Observed
from service.models.workbench.records import Records, unusable


def given(inputs: WorkInputs) -> ModelFile:
    """The version as a file would have it."""
    direction = cast(Directions, inputs.direction)
    return ModelFile(inputs.description.code, direction, inputs.isolator, inputs.reference)


def records(inputs: WorkInputs, seen: Sequence[Observed]) -> Records:
    """The events that were asked for, those held out and those that cannot be used among them, in order of time.

    Before the first the layer is taken to be new.
    """
    wanted = sorted((one for one in seen if one.event.is_wanted), key=lambda one: one.event.start)
    return Records(
        description=inputs.description,
        band=inputs.band,
        observations=tuple(observation for one in wanted for observation, _ in one.seen),
        left_out=frozenset(one.event.name for one in wanted if one.event.is_held_out),
        reference=inputs.reference,
        forces=tuple((observation.direction, force) for one in wanted for observation, force in one.seen),
        analyses=tuple(one.analysis for one in wanted),
        unused=tuple(
            f"{one.event.name}: {why}"
            for one in wanted
            if (why := unusable(one.analysis, [found.direction for found, _ in one.seen], inputs.directions))
        ),
    )
