"""Records corrected in a copy for the faults of sensors that they show, and forces for wrong masses."""

from collections.abc import Sequence
from dataclasses import replace

from core.analysis import analyse
from core.diagnosis.building_faults import floor_share_fault
from core.diagnosis.corrections import Correction, corrected, correction, turned_axes
from core.diagnosis.floor_share import FloorShare, with_floor_share
from core.diagnosis.sensor_faults import sensor_faults
from core.errors import CoreError
from core.workbench.earthquakes import AnalysedEarthquake, Earthquakes, analysed, joined
from core.workbench.progress import Progress, silent

ROUNDS = 2
"""Rounds of correction at most: a reversed channel shows its gain after it was turned. A choice."""


def corrected_copy(earthquakes: Earthquakes, progress: Progress = silent) -> Earthquakes:
    """The earthquakes with all faults of sensors corrected that can be, `corrected` among them.

    The same where no fault can be corrected, where the samples are not at hand, and of such a copy.

    Args:
        earthquakes: of a building.
        progress: called with each step.
    """
    seen, description = earthquakes, earthquakes.description
    if (
        seen.corrected
        or description is None
        or any(one.recording is None for one in seen.sources if one.analysis is not None)
    ):
        return seen
    for _ in range(ROUNDS):
        known = {(one.channel, one.kind) for one in seen.corrected}
        found = [one for one in sensor_faults(seen.analyses, description) if (one.channel, one.kind) not in known]
        each = [(one, how) for one in found if (how := correction(one, seen.analyses, description)) is not None]
        if not each:
            break
        made: list[AnalysedEarthquake] = []
        for number, one in enumerate(seen.sources):
            progress("correcting the records for faults of sensors", number, len(seen.sources))
            made.append(_remade(one, [how for _, how in each]))
        faults = (*seen.corrected, *(replace(one, is_corrected=True) for one, _ in each))
        again = joined(made, description, seen.band, reference=seen.reference, held_out=seen.held_out)
        seen = replace(again, corrected=faults)
    return seen


def with_corrected_masses(earthquakes: Earthquakes, found: FloorShare) -> Earthquakes:
    """The earthquakes with the forces of all observations for another share of the floors in the same total mass.

    Args:
        earthquakes: with the forces of the building file's masses.
        found: the share.
    """
    return replace(
        earthquakes,
        observations=tuple(with_floor_share(one, found.change) for one in earthquakes.observations),
        corrected=(*earthquakes.corrected, floor_share_fault(found)),
        share_change=found.change,
    )


def _remade(one: AnalysedEarthquake, wanted: Sequence[Correction]) -> AnalysedEarthquake:
    recording = one.recording
    if recording is None:
        return one
    described = turned_axes(recording.description, wanted)
    copy = replace(recording, segments=corrected(recording.segments, wanted), description=described)
    try:
        return analysed(one.name, analyse(copy.segments, copy.description, copy.settings), copy)
    except CoreError as error:
        return AnalysedEarthquake(one.name, None, (), str(error), copy)
