"""What do some files tell of a building's isolation layer?"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from itertools import pairwise
from pathlib import Path

from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.description import BuildingDescription
from core.errors import CoreError, IdentificationError, RecordError
from core.fitting.observation import Observation, observations
from core.record import Direction
from core.restoring_force.estimator import RestoringForce
from core.restoring_force.known_superstructure import KnownSuperstructure, known_superstructure
from service.buildings.description import BuildingFile
from service.jobs.progress import Tell
from service.records.event_files import EventFiles, events

NEVER = datetime(1970, 1, 1, tzinfo=UTC)
"""Reference where there is no record to count from."""
Seen = tuple[Observation, RestoringForce]
"""Of one earthquake in one direction."""


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """The earthquakes in some files, as a model is held against them."""

    description: BuildingDescription
    band: tuple[float, float]
    """Hz, of every estimated force."""
    observations: tuple[Observation, ...]
    """In order of time."""
    left_out: frozenset[str]
    """Names of the earthquakes that nothing is fitted to."""
    reference: datetime
    """From which effects count time."""
    forces: tuple[tuple[Direction, RestoringForce], ...]
    """Estimated in each record and direction."""
    analyses: tuple[EventAnalysis, ...]
    """Of every earthquake, also of those that cannot be used."""
    unused: tuple[str, ...]
    """Earthquakes that cannot be used, in one direction or in all, with their reason."""

    @property
    def fitted(self) -> tuple[Observation, ...]:
        """Those that a model may be fitted to."""
        return tuple(one for one in self.observations if one.name not in self.left_out)

    def superstructure(self, direction: Direction) -> KnownSuperstructure | str:
        """What is known of it in one direction, or why nothing is."""
        try:
            return known_superstructure([force for of, force in self.forces if of == direction], self.description)
        except IdentificationError as error:
            return str(error)


@dataclass(frozen=True, slots=True)
class Reading:
    """How records are to be read."""

    directions: Sequence[Direction]
    """That the model is of."""
    reference: datetime | None
    """From which effects count time; None for the start of the first record."""
    settings: AnalysisSettings


def records(
    paths: Sequence[Path], left_out: Sequence[Path], building: BuildingFile, reading: Reading, tell: Tell
) -> Records:
    """Analyse every earthquake in the files.

    Args:
        paths: records, and StationXML.
        left_out: the same, of earthquakes that nothing is to be fitted to.
        building: whose they are.
        reading: what to look for in them.
        tell: for who waits.

    Raises:
        FormatError: a file that cannot be used, or that is not this building's.
        RecordError: an earthquake that is left out is also among the others.
    """
    found = [(event, False) for event in events(paths, building)]
    found += [(event, True) for event in (events(left_out, building) if left_out else ())]
    found.sort(key=lambda pair: pair[0].start)
    _check_apart(found)
    reference = reading.reference or (found[0][0].start if found else NEVER)
    seen: list[Seen] = []
    analyses: list[EventAnalysis] = []
    unused: list[str] = []
    for number, (event, _) in enumerate(found):
        tell(f"reading the earthquake of {named(event.start)}", number, len(found))
        analysis = _analysed(event, building.description, reading.settings)
        if isinstance(analysis, str):
            unused.append(f"{named(event.start)}: {analysis}")
            continue
        read = _seen(analysis, event, building, reading, reference)
        seen += read
        analyses.append(analysis)
        why = unusable(analysis, [one.direction for one, _ in read], reading.directions)
        unused += [] if why is None else [f"{named(event.start)}: {why}"]
    tell("read", len(found), len(found))
    return Records(
        description=building.description,
        band=reading.settings.band,
        observations=tuple(one for one, _ in seen),
        left_out=frozenset(named(event.start) for event, is_left_out in found if is_left_out),
        reference=reference,
        forces=tuple((one.direction, force) for one, force in seen),
        analyses=tuple(analyses),
        unused=tuple(unused),
    )


def named(start: datetime) -> str:
    """The name of an earthquake: when its record starts, UTC."""
    return f"{start:%Y-%m-%d %H:%M:%S}"


def _check_apart(found: Sequence[tuple[EventFiles, bool]]) -> None:
    for (one, _), (other, _) in pairwise(found):
        if named(one.start) == named(other.start):
            raise RecordError(
                f"the earthquake of {named(one.start)} is left out, and among the others too; once would do"
            )


def _analysed(event: EventFiles, description: BuildingDescription, settings: AnalysisSettings) -> EventAnalysis | str:
    """Or why it cannot be."""
    try:
        return analyse(event.segments, description, settings)
    except CoreError as error:
        return str(error)


def unusable(analysis: EventAnalysis, used: Collection[str], wanted: Sequence[str]) -> str | None:
    """Why some directions of an earthquake cannot be used; None if all can.

    Args:
        analysis: of the earthquake.
        used: directions that can.
        wanted: directions of the model.
    """
    if analysis.refusal is not None:
        return analysis.refusal
    lacking = " and ".join(direction for direction in wanted if direction not in used)
    fatal = "; ".join(finding.message for finding in analysis.quality if finding.severity == "fatal")
    unknown = f"neither force nor motion of the layer is known in direction {lacking}"
    return (fatal or unknown) if lacking else None


def _seen(
    analysis: EventAnalysis, event: EventFiles, building: BuildingFile, reading: Reading, reference: datetime
) -> list[Seen]:
    """In each direction that can be used."""
    if analysis.refusal is not None:
        return []
    return [
        (one, analysis.directions[one.direction].restoring_force)
        for one in observations(analysis, building.description, named(event.start), reference)
        if one.direction in reading.directions
    ]
