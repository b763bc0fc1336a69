"""Earthquakes as the workbench reads them from files, made of observations instead."""

from collections.abc import Collection, Sequence
from dataclasses import replace

from building_models import paper

from core.fitting.observation import Observation
from core.signals.conditioning import band_passed
from core.workbench.earthquakes import Earthquakes

BAND = (0.1, 30.0)
"""Hz."""


def records_from_observations(seen: Sequence[Observation], left_out: Collection[str] = ()) -> Earthquakes:
    """Their forces within the pass band; of floors and ground nothing is known, so that nothing can be predicted."""
    return Earthquakes(
        description=paper(),
        band=BAND,
        observations=tuple(
            replace(one, layer=replace(one.layer, force=band_passed(one.layer.force, one.rate, BAND))) for one in seen
        ),
        held_out=frozenset(left_out),
        reference=seen[0].start,
        forces=(),
        analyses=(),
        unused=("2021-02-01 00:00:00: the record is too short",),
    )
