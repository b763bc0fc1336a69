"""By how much one more accelerometer would narrow the force and the modes, from the building's own records."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.analysis import USUAL, AnalysisSettings, EventAnalysis
from core.arrays import Vector
from core.description import BuildingDescription
from core.errors import CoreError, RecordError
from core.estimators.frame.added_channel import Errors, Gains, gains
from core.estimators.superstructure import instrumented_superstructure
from core.record import Direction
from core.rounding import significant
from core.tables import Table, report
from core.workbench.progress import Progress, silent

MODES = 3
"""Modes in a table."""
ASSUMED = (
    "Assumed: the superstructure as calibrated from each record, with what is uncertain of it, and a noise of the new "
    "channel in the middle of the others'. Where a new channel shows that masses and sensors are as given, it narrows "
    "the force more than this."
)


@dataclass(frozen=True, slots=True, eq=False)
class AddedSensor:
    """One more accelerometer in one direction; standard deviations are over all records."""

    direction: Direction
    level: str
    force: float
    """N, standard deviation of the force with it."""
    force_ratio: float
    """The same over that of today."""
    frequency_ratios: Vector
    """(modes,) of the frequencies' standard deviations."""
    damping_ratios: Vector
    """(modes,) of the damping ratios' standard deviations."""


@dataclass(frozen=True, slots=True, eq=False)
class Today:
    """Standard deviations in one direction with the sensors that there are."""

    direction: Direction
    records: int
    force: float
    """N, root mean square over all records, by noise and by what the records leave open."""
    frequency: Vector
    """(modes,) Hz, fixed-base."""
    frequency_std: Vector
    """(modes,) Hz."""


@dataclass(frozen=True, slots=True, eq=False)
class AddedSensors:
    """Every level without an accelerometer, in each direction, that which narrows the force most first."""

    building: str
    today: tuple[Today, ...]
    sensors: tuple[AddedSensor, ...]
    remarks: tuple[str, ...]
    """Records that could not be used, with the reason."""

    @property
    def text(self) -> tuple[str, ...]:
        """Sentences: the force today and with the best new sensor, by direction, and what is assumed."""
        return (*_sentences(self), ASSUMED)

    def __str__(self) -> str:
        tables = [_table(self, one) for one in self.today]
        return report(f"{self.building}: one more accelerometer", self.text, *tables, self.remarks)


def added_sensors(
    analyses: Sequence[EventAnalysis],
    description: BuildingDescription,
    settings: AnalysisSettings = USUAL,
    *,
    progress: Progress = silent,
) -> AddedSensors:
    """Standard deviations of the force and of the modes as one more accelerometer at each level would leave them.

    Args:
        analyses: of the building's earthquakes.
        description: of the building.
        settings: of the analyses.
        progress: called with each step.

    Raises:
        RecordError: no record shows the superstructure in any direction.
    """
    found: dict[Direction, list[Gains]] = {}
    remarks: dict[str, None] = {}
    for number, one in enumerate(analyses):
        progress(f"calibrating the superstructure in {one.start:%Y-%m-%d %H:%M:%S}", number, len(analyses))
        for direction in one.directions:
            try:
                found.setdefault(direction, []).append(_gains(one, description, settings, direction))
            except CoreError as error:
                remarks[f"{one.start:%Y-%m-%d %H:%M:%S}, direction {direction}: {error}"] = None
    progress("calibrated", len(analyses), len(analyses))
    there = {direction: _alike(each) for direction, each in found.items() if each}
    if not there:
        raise RecordError("; ".join(remarks) or "no record has a force; give one with usable accelerations")
    sensors = [one for direction, each in there.items() for one in _sensors(direction, each, description)]
    today = tuple(_today(direction, each) for direction, each in there.items())
    return AddedSensors(
        description.code, today, tuple(sorted(sensors, key=lambda one: one.force_ratio)), tuple(remarks)
    )


def _gains(
    analysis: EventAnalysis, description: BuildingDescription, settings: AnalysisSettings, direction: Direction
) -> Gains:
    if analysis.record is None:
        raise RecordError("the record cannot be used")
    band = analysis.band or settings.band
    return gains(instrumented_superstructure(analysis.record, description, direction, settings.sensors, band))


def _alike(each: Sequence[Gains]) -> list[Gains]:
    """Gains in the earthquakes in which the same floors lack a sensor as in the last; channels may have changed."""
    floors = [floor for floor, _ in each[-1].added]
    return [one for one in each if [floor for floor, _ in one.added] == floors]


def _today(direction: Direction, each: Sequence[Gains]) -> Today:
    frequency = np.exp(np.mean([np.log(one.frequency) for one in each], axis=0))
    return Today(
        direction,
        len(each),
        _root([one.now.force for one in each]),
        frequency,
        frequency * np.sqrt(np.mean([one.now.frequency**2 for one in each], axis=0)),
    )


def _sensors(direction: Direction, each: Sequence[Gains], description: BuildingDescription) -> list[AddedSensor]:
    made = []
    for place, (floor, _) in enumerate(each[0].added):
        after: list[Errors] = [one.added[place][1] for one in each]
        force = _root([one.force for one in after])
        pairs = list(zip(after, [one.now for one in each], strict=True))
        made.append(
            AddedSensor(
                direction,
                description.floors[floor].name,
                force,
                force / _root([one.now.force for one in each]),
                np.exp(np.mean([np.log(one.frequency / now.frequency) for one, now in pairs], axis=0)),
                np.exp(np.mean([np.log(one.damping / now.damping) for one, now in pairs], axis=0)),
            )
        )
    return made


def _root(values: Sequence[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _sentences(result: AddedSensors) -> list[str]:
    said = []
    for one in result.today:
        best = next((sensor for sensor in result.sensors if sensor.direction == one.direction), None)
        records = f"{one.records} record" if one.records == 1 else f"{one.records} records"
        force = f"the force has a standard deviation of {_kilonewtons(one.force)}"
        said.append(f"Direction {one.direction}, by {records}: {force}.")
        if best is None:
            said.append("Every level has an accelerometer.")
        else:
            said.append(f"One more accelerometer at {best.level} would make it {_kilonewtons(best.force)}.")
    return said


def _table(result: AddedSensors, today: Today) -> Table:
    modes = min(MODES, today.frequency.size)
    rows = tuple(
        (
            one.level,
            _kilonewtons(one.force),
            _percent(one.force_ratio),
            *(_percent(float(one.frequency_ratios[mode])) for mode in range(modes)),
            *(_percent(float(one.damping_ratios[mode])) for mode in range(modes)),
        )
        for one in result.sensors
        if one.direction == today.direction
    )
    names = [f"{significant(float(today.frequency[mode]))} Hz" for mode in range(modes)]
    headings = ("level", "force", "of today", *names, *(f"damping of {name}" for name in names))
    note = "Standard deviations with one more accelerometer at the level; in percent of those of today."
    return Table(f"Direction {today.direction}", headings, rows, note)


def _kilonewtons(value: float) -> str:
    return f"{significant(value * 1e-3)} kN"


def _percent(ratio: float) -> str:
    return f"{100 * ratio:.0f} %"
