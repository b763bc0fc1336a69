"""What do some files tell of a building's isolation layer?"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.description import BuildingDescription
from core.errors import CoreError, IdentificationError
from core.estimator import RestoringForce
from core.known_superstructure import KnownSuperstructure, known_superstructure
from core.observation import Observation, observations
from core.record import Direction
from service.building_file import BuildingFile
from service.event_files import EventFiles, events

Tell = Callable[[str, int, int], None]
"""Called with what is being done, how many are done, and of how many."""


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """The earthquakes in some files, as a model is held against them."""

    description: BuildingDescription
    band: tuple[float, float]
    """Hz, of every estimated force."""
    observations: tuple[Observation, ...]
    """In order of time."""
    forces: tuple[tuple[Direction, RestoringForce], ...]
    """Estimated in each record and direction."""
    unused: tuple[str, ...]
    """Earthquakes that cannot be used, with their reason."""

    def superstructure(self, direction: Direction) -> KnownSuperstructure | str:
        """What is known of it in one direction, or why nothing is."""
        try:
            return known_superstructure([force for of, force in self.forces if of == direction], self.description)
        except IdentificationError as error:
            return str(error)


def records(
    paths: Sequence[Path],
    building: BuildingFile,
    directions: Sequence[Direction],
    reference: datetime | None,
    settings: AnalysisSettings,
    tell: Tell,
) -> Records:
    """Analyse every earthquake in the files.

    Args:
        paths: records, and StationXML.
        building: whose they are.
        directions: that the model is of.
        reference: from which effects count time; None for the start of the first record.
        settings: of the analysis.
        tell: for who waits.

    Raises:
        FormatError: a file that cannot be used, or that is not this building's.
    """
    found = events(paths, building)
    seen: list[Observation] = []
    forces: list[tuple[Direction, RestoringForce]] = []
    unused: list[str] = []
    for number, event in enumerate(found):
        name = named(event.start)
        tell(f"reading the earthquake of {name}", number, len(found))
        analysis = _analysed(event, building.description, settings)
        if isinstance(analysis, str):
            unused.append(f"{name}: {analysis}")
            continue
        usable = observations(analysis, building.description, name, reference or found[0].start)
        usable = tuple(one for one in usable if one.direction in directions)
        seen += usable
        forces += [(one.direction, analysis.directions[one.direction].restoring_force) for one in usable]
        if not usable:
            unused.append(f"{name}: {_why(analysis, directions)}")
    tell("read", len(found), len(found))
    return Records(building.description, settings.band, tuple(seen), tuple(forces), tuple(unused))


def named(start: datetime) -> str:
    """The name of an earthquake: when its record starts, UTC."""
    return f"{start:%Y-%m-%d %H:%M:%S}"


def _analysed(event: EventFiles, description: BuildingDescription, settings: AnalysisSettings) -> EventAnalysis | str:
    try:
        analysis = analyse(event.segments, description, settings)
    except CoreError as error:
        return str(error)
    return analysis if analysis.refusal is None else analysis.refusal


def _why(analysis: EventAnalysis, directions: Sequence[Direction]) -> str:
    fatal = [finding.message for finding in analysis.quality if finding.severity == "fatal"]
    wanted = " and ".join(directions)
    return "; ".join(fatal) or f"neither force nor motion of the layer is known in direction {wanted}"
