"""Earthquakes of a building, read from files and analysed."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from pathlib import Path

from core.analysis import AnalysisSettings, analyse
from core.description import BuildingDescription
from core.errors import CoreError, RecordError
from core.record import Direction
from core.workbench.earthquakes import EPOCH, AnalysedEarthquake, Earthquakes, analysed, joined
from service.buildings.description import BuildingFile
from service.jobs.stages import ReportStep
from service.records.event_files import EventFiles, events


@dataclass(frozen=True, slots=True)
class Reading:
    """Choices for reading records."""

    directions: Sequence[Direction]
    """Directions of the model."""
    reference: datetime | None
    """Instant from which effects count time; None for the start of the first record."""
    settings: AnalysisSettings


def records(
    paths: Sequence[Path], left_out: Sequence[Path], building: BuildingFile, reading: Reading, report_step: ReportStep
) -> Earthquakes:
    """Analyse every earthquake in the files.

    Args:
        paths: records, and StationXML.
        left_out: the same, of the held-out earthquakes.
        building: the building.
        reading: choices.
        report_step: called with each step.

    Raises:
        FormatError: a file that cannot be used, or that is not this building's.
        RecordError: a held-out earthquake is also among the others.
    """
    found = [(event, False) for event in events(paths, building)]
    found += [(event, True) for event in (events(left_out, building) if left_out else ())]
    found.sort(key=lambda pair: pair[0].start)
    _check_apart(found)
    reference = reading.reference or (found[0][0].start if found else EPOCH)
    each: list[AnalysedEarthquake] = []
    for number, (event, _) in enumerate(found):
        report_step(f"reading the earthquake of {named(event.start)}", number, len(found))
        each.append(_analysed(event, building.description, reading, reference))
    report_step("read", len(found), len(found))
    held_out = [named(event.start) for event, is_held_out in found if is_held_out]
    return joined(each, building.description, reading.settings.band, reference=reference, held_out=held_out)


def named(start: datetime) -> str:
    """Name of an earthquake: the start of its record, UTC."""
    return f"{start:%Y-%m-%d %H:%M:%S}"


def _check_apart(found: Sequence[tuple[EventFiles, bool]]) -> None:
    for (one, _), (other, _) in pairwise(found):
        if named(one.start) == named(other.start):
            raise RecordError(
                f"the earthquake of {named(one.start)} is held out, and also among the others; give it once"
            )


def _analysed(
    event: EventFiles, description: BuildingDescription, reading: Reading, reference: datetime
) -> AnalysedEarthquake:
    name = named(event.start)
    try:
        analysis = analyse(event.segments, description, reading.settings)
    except CoreError as error:
        return AnalysedEarthquake(name, None, (), str(error))
    return analysed(name, analysis, description, reading.directions, reference)
