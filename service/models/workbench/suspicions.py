"""What is wrong before the isolation layer is asked: sensors, superstructure, mass?"""

from collections.abc import Iterator, Sequence
from typing import Any

from core.diagnosis.suspect import Cause, Suspect
from service.models.workbench.comparison_json import finite
from service.version import VERSION

CALLED = {Cause.SENSOR: "The sensor {}", Cause.SUPERSTRUCTURE: "The superstructure", Cause.MASS: "The mass"}


def first_cause(found: Sequence[Suspect]) -> Cause | None:
    """What is to be put right first; None if nothing is suspected."""
    return next((cause for cause in Cause if any(one.cause is cause for one in found)), None)


def words(found: Sequence[Suspect]) -> tuple[str, ...]:
    """Sentences; none if nothing is suspected."""
    return tuple(_sentences(found))


def as_json(found: Sequence[Suspect]) -> list[dict[str, Any]]:
    """SI units."""
    return [
        {
            "cause": one.cause.value,
            "kind": one.kind,
            "channel": one.channel,
            "value": one.value,
            "std": one.std,
            "message": one.message,
        }
        for one in found
    ]


def alone_as_json(building: str, found: Sequence[Suspect], unused: Sequence[str]) -> dict[str, Any]:
    """A diagnosis that ended here, since no record can be used."""
    cause = first_cause(found)
    return finite(
        {
            "version": VERSION,
            "building": building,
            "outcome": None if cause is None else cause.value,
            "findings": as_json(found),
            "candidates": [],
            "dropped": [],
            "set": [],
            "unknown_flag": False,
            "steps": [],
            "explanation": " ".join(words(found)),
            "unused": list(unused),
        }
    )


def _sentences(found: Sequence[Suspect]) -> Iterator[str]:
    for one in found:
        yield f"{CALLED[one.cause].format(one.channel)}: {one.message.rstrip('.')}."
    if found:
        yield "Put that right first: what is said of the isolation layer below may be its doing."
