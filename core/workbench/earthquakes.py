"""Earthquakes that a model is compared with, and the errors of a model in them."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np

from core.analysis import AnalysisSettings, EventAnalysis
from core.comparison.compared import Band, ForceComparison, compare_forces, force_misfit
from core.comparison.misfit import Misfit
from core.comparison.prediction import Prediction, predict_all
from core.description import BuildingDescription
from core.diagnosis.effect_search import LOWERS
from core.diagnosis.sensor_faults import BuildingFault
from core.errors import IdentificationError, RecordError
from core.estimators.result import RestoringForce
from core.estimators.superstructure import KnownSuperstructure, known_superstructure
from core.fitting.observation import Observation, observations
from core.model.isolator import Isolator
from core.record import Direction, Segment
from core.rounding import plain
from core.tables import Table, report
from core.units import shown, unit

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)
"""Instant from which effects count time unless another is given."""
USUAL_BAND = (0.1, 30.0)
"""Hz, of forces whose own band is not known."""
TOGETHER = timedelta(milliseconds=1)
"""Instants nearer than this are the same. A choice."""
FITTED, HELD_OUT = "all fitted", "all held out"
"""Groups of earthquakes, as tables name them."""
HELPS = 0.98
"""Ratio of the errors with and without a change on held-out earthquakes, below which the change helps there. A
choice."""


def peak(one: Observation) -> float:
    """m, largest displacement of the layer."""
    return float(np.abs(one.layer.displacement).max())


@dataclass(frozen=True, slots=True, eq=False)
class Earthquakes:
    """Observations of one building, with everything that the workbench needs besides."""

    observations: tuple[Observation, ...]
    """In order of time."""
    band: Band = USUAL_BAND
    """Hz, of every estimated force."""
    held_out: frozenset[str] = frozenset()
    """Names of the earthquakes that nothing is fitted to."""
    reference: datetime = EPOCH
    """Instant from which effects count time."""
    description: BuildingDescription | None = None
    """None where the building is not described: then the floors are not predicted."""
    forces: tuple[tuple[Direction, RestoringForce], ...] = ()
    """Restoring forces as estimated, by direction; they carry the superstructure."""
    analyses: tuple[EventAnalysis, ...] = ()
    """Analyses of all earthquakes, also of those that cannot be used: they show faults of sensors."""
    unused: tuple[str, ...] = ()
    """Earthquakes that cannot be used, in one direction or in all, each with its reason."""
    sources: tuple["AnalysedEarthquake", ...] = ()
    """Earthquakes that these observations come from; none where the observations came alone."""
    corrected: tuple[BuildingFault, ...] = ()
    """Faults of sensors and masses for which the records of these earthquakes, or their forces, were corrected."""
    share_change: float = 0.0
    """Relative change of the floors' share of the mass, by which the forces of the observations were corrected."""

    def __str__(self) -> str:
        rows = tuple(
            (
                self.label(one.name, one.direction),
                f"{one.start:%Y-%m-%d %H:%M}",
                f"{plain(shown(peak(one), 'm'), 3)} {unit('m')}",
                f"{plain(shown(float(np.abs(one.layer.force).max()), 'N'), 3)} {unit('N')}",
                "held out" if one.name in self.held_out else "fitted",
            )
            for one in self.observations
        )
        headings = ("earthquake", "start, UTC", "displacement", "force", "use")
        table = Table("Largest values of the isolation layer", headings, rows, texts=("start, UTC", "use"))
        count = len({one.name for one in self.observations})
        return report(f"{count} earthquake{'' if count == 1 else 's'}", table, self.unused)

    @classmethod
    def of(cls, seen: "Sequence[Observation] | Earthquakes", hold_out: Collection[str] = ()) -> "Earthquakes":
        """Observations as the workbench uses them; of a set that is one already, the same with more held out.

        Raises:
            RecordError: there are none, two have one name or one start, bands differ, or a held-out name is unknown.
        """
        made = seen if isinstance(seen, Earthquakes) else _collected(seen)
        if unknown := sorted(set(hold_out) - {one.name for one in made.observations}):
            names = ", ".join(dict.fromkeys(one.name for one in made.observations))
            raise RecordError(f"no earthquake is called {', '.join(unknown)}; there are {names}")
        return replace(made, held_out=made.held_out | set(hold_out)) if hold_out else made

    @property
    def fitted(self) -> tuple[Observation, ...]:
        """Observations that a model may be fitted to."""
        return tuple(one for one in self.observations if one.name not in self.held_out)

    @property
    def tested(self) -> tuple[Observation, ...]:
        """Observations that only test a model."""
        return tuple(one for one in self.observations if one.name in self.held_out)

    @property
    def fitted_names(self) -> tuple[str, ...]:
        """Names of the earthquakes that a model may be fitted to."""
        return tuple(dict.fromkeys(one.name for one in self.fitted))

    @property
    def strongest(self) -> Observation:
        """The observation of largest displacement that a model may be fitted to."""
        return max(self.fitted, key=peak)

    @property
    def directions(self) -> tuple[Direction, ...]:
        """Directions of the observations."""
        return tuple(dict.fromkeys(one.direction for one in self.observations))

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """Names of the earthquakes that were fitted, and of those held out if there are any."""
        names = tuple(dict.fromkeys(one.name for one in self.observations))
        parted = {
            FITTED: tuple(name for name in names if name not in self.held_out),
            HELD_OUT: tuple(name for name in names if name in self.held_out),
        }
        return {group: members for group, members in parted.items() if members}

    @property
    def motion_is_restored(self) -> bool:
        """True if slow motion was restored to a displacement that was integrated from accelerations."""
        motions = [one.motion for analysis in self.analyses for one in analysis.directions.values()]
        return any(motion is not None and motion.is_restored for motion in motions)

    def superstructure(self, direction: Direction) -> KnownSuperstructure | str:
        """The superstructure in one direction, or the reason why it is not known."""
        if self.description is None:
            return "the building is not described, so its floors cannot be predicted"
        try:
            return known_superstructure([force for of, force in self.forces if of == direction], self.description)
        except IdentificationError as error:
            return str(error)

    def label(self, name: str, direction: Direction) -> str:
        """Name of an earthquake in tables and pictures, with the direction where there are several."""
        return label(name, direction, self.directions)


def label(name: str, direction: str, directions: Collection[str]) -> str:
    """Name of an earthquake in tables and pictures, with its direction if several directions are shown."""
    return f"{name} {direction}" if len(directions) > 1 else name


def _collected(seen: Sequence[Observation]) -> Earthquakes:
    if not seen:
        raise RecordError("there is no observation; give an earthquake with force and motion of the layer")
    ordered = tuple(sorted(seen, key=lambda one: one.start))
    for what, keys in (
        ("name", [(one.name, one.direction) for one in ordered]),
        ("start", [(one.start, one.direction) for one in ordered]),
    ):
        if len(set(keys)) < len(keys):
            raise RecordError(f"two observations of one direction have the same {what}; give each earthquake its own")
    bands = {one.layer.band or USUAL_BAND for one in ordered}
    if len(bands) > 1:
        raise RecordError(f"the forces were estimated in different bands, {sorted(bands)} Hz; use one for all")
    ordered, reference = _from_one_instant(ordered)
    return Earthquakes(
        observations=ordered,
        band=bands.pop(),
        reference=reference,
        description=next((one.building for one in ordered if one.building is not None), None),
        forces=tuple((one.direction, one.estimate) for one in ordered if one.estimate is not None),
    )


def _from_one_instant(ordered: tuple[Observation, ...]) -> tuple[tuple[Observation, ...], datetime]:
    """Observations that count time from the same instant: theirs if they agree, else the start of the first."""
    instants = [one.start - timedelta(seconds=float(one.conditions.time[0])) for one in ordered]
    if max(instants) - min(instants) < TOGETHER:
        return ordered, instants[0]
    first = ordered[0].start
    shifted = (
        replace(one, conditions=replace(one.conditions, time=one.conditions.time + (instant - first).total_seconds()))
        for one, instant in zip(ordered, instants, strict=True)
    )
    return tuple(shifted), first


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Everything that an earthquake's analysis and observations are made from."""

    segments: tuple[Segment, ...]
    description: BuildingDescription
    """The building's description at that time."""
    settings: AnalysisSettings
    directions: tuple[str, ...]
    """Horizontal directions of the model."""
    reference: datetime
    """Instant from which effects count time."""


@dataclass(frozen=True, slots=True, eq=False)
class AnalysedEarthquake:
    """One earthquake with its analysis, as far as the workbench can use it."""

    name: str
    """Unique among the earthquakes of a building."""
    analysis: EventAnalysis | None
    """None where the records could not be analysed at all."""
    observations: tuple[Observation, ...]
    """By direction, of those that can be used."""
    reason: str | None
    """Reason why some directions cannot be used; None if all can."""
    recording: Recording | None = None
    """Samples of the analysis; None if they are not at hand."""


def analysed(name: str, analysis: EventAnalysis, recording: Recording) -> AnalysedEarthquake:
    """An earthquake from its analysis.

    Args:
        name: of the earthquake.
        analysis: of it.
        recording: what the analysis was made from.
    """
    every = observations(analysis, recording.description, name, recording.reference)
    seen = tuple(one for one in every if one.direction in recording.directions)
    reason = unusable(analysis, [one.direction for one in seen], recording.directions)
    return AnalysedEarthquake(name, analysis, seen, reason, recording)


def unusable(analysis: EventAnalysis, used: Collection[str], wanted: Sequence[str]) -> str | None:
    """Reason why some directions of an earthquake cannot be used; None if all can.

    Args:
        analysis: of the earthquake.
        used: directions that can be used.
        wanted: directions of the model.
    """
    if analysis.refusal is not None:
        return analysis.refusal
    lacking = " and ".join(direction for direction in wanted if direction not in used)
    fatal = "; ".join(finding.message for finding in analysis.quality if finding.severity == "fatal")
    unknown = f"neither force nor motion of the layer is known in direction {lacking}"
    return (fatal or unknown) if lacking else None


def joined(
    each: Sequence[AnalysedEarthquake],
    description: BuildingDescription,
    band: Band,
    *,
    reference: datetime = EPOCH,
    held_out: Collection[str] = (),
) -> Earthquakes:
    """Analysed earthquakes of one building.

    Args:
        each: in order of time.
        description: of the building, in force.
        band: Hz, of every estimated force.
        reference: instant from which effects count time, aware.
        held_out: names of the earthquakes that nothing is fitted to.
    """
    seen = [(one.analysis, observation) for one in each if one.analysis for observation in one.observations]
    return Earthquakes(
        observations=tuple(observation for _, observation in seen),
        band=band,
        held_out=frozenset(held_out),
        reference=reference,
        description=description,
        forces=tuple((one.direction, analysis.directions[one.direction].restoring_force) for analysis, one in seen),
        analyses=tuple(one.analysis for one in each if one.analysis is not None),
        unused=tuple(f"{one.name}: {one.reason}" for one in each if one.reason),
        sources=tuple(each),
    )


@dataclass(frozen=True, slots=True, eq=False)
class ModelErrors:
    """One model beside the measurements of all earthquakes."""

    forces: tuple[ForceComparison, ...]
    """Restoring forces for the measured motion, in order of time."""
    predictions: tuple[Prediction, ...]
    """Responses to the ground motion alone, of the earthquakes in which the ground was measured."""
    remarks: tuple[str, ...]
    """Assumptions of the predictions, and reasons why some could not be made."""

    def of(self, names: Collection[str]) -> "ModelErrors":
        """The errors in the earthquakes of these names."""
        return replace(
            self,
            forces=tuple(one for one in self.forces if one.observation.name in names),
            predictions=tuple(one for one in self.predictions if one.observation.name in names),
        )

    def along(self, direction: Direction) -> "ModelErrors":
        """The errors in one direction."""
        return replace(
            self,
            forces=tuple(one for one in self.forces if one.observation.direction == direction),
            predictions=tuple(one for one in self.predictions if one.observation.direction == direction),
        )

    @property
    def noise_ratio(self) -> float:
        """Error of the forces over the error that noise alone makes, each earthquake by its own noise."""
        return force_misfit(self.forces).noise_ratio


def model_errors(model: Isolator, earthquakes: Earthquakes, names: Collection[str] | None = None) -> ModelErrors:
    """Errors of a model in earthquakes; states that the layer keeps pass through all of them in order of time.

    Args:
        model: the model.
        earthquakes: held-out ones among them.
        names: earthquakes whose errors are returned; None for all.

    Raises:
        ModelError: the model's force grew beyond all bounds.
    """
    forces = tuple(
        one
        for one in compare_forces(model, earthquakes.observations, earthquakes.band)
        if names is None or one.observation.name in names
    )
    known = {of: earthquakes.superstructure(of) for of in sorted({one.observation.direction for one in forces})}
    sources = tuple(
        f"direction {direction}: {one if isinstance(one, str) else one.source}" for direction, one in known.items()
    )
    if earthquakes.description is None:
        return ModelErrors(forces, (), sources)
    modes = {direction: one.modes for direction, one in known.items() if not isinstance(one, str)}
    predicted = predict_all(forces, modes, model, earthquakes.description, earthquakes.band)
    return ModelErrors(forces, predicted.each, (*sources, *predicted.remarks))


@dataclass(frozen=True, slots=True, eq=False)
class Version:
    """One state of a model in the course of the work on it."""

    name: str
    """The last change, in a few words."""
    errors: ModelErrors

    def error(self, names: Sequence[str]) -> Misfit:
        """N, of the force in the earthquakes of these names."""
        return force_misfit(self.errors.of(names).forces)


def lowers(before: Version, after: Version, earthquakes: Earthquakes) -> bool:
    """True if the force's error falls by an amount that matters, where it was fitted or on held-out earthquakes."""
    return any(after.error(names).rms < LOWERS * before.error(names).rms for names in earthquakes.groups.values())


def helps(before: Version, after: Version, earthquakes: Earthquakes) -> bool:
    """True if the error of the force falls on held-out earthquakes; true if there are none."""
    names = earthquakes.groups.get(HELD_OUT, ())
    return not names or after.error(names).rms < HELPS * before.error(names).rms
