"""Forecast of one ground motion: the response of layer and floors, with 95 % intervals.

The interval of a peak has two parts. The values of the model are moved by the steps of their covariance, one at a time,
and the building is simulated for each (central differences). The model's own error is what its predictions from the
ground motion alone missed in the records, weighted by how near their amplitude is; it grows where the isolators move
farther than in any record.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from math import exp, hypot, log, sqrt
from typing import Literal

import numpy as np
import scipy

from core.arrays import Vector
from core.description import BuildingDescription
from core.effects import EFFECTS
from core.errors import RecordError
from core.fitting.observation import CROSS
from core.forecasting.experience import Experience, Kind, Miss, typical
from core.forecasting.ground_motion import (
    GroundMotion,
    Scaling,
    ToDisplacement,
    ToPga,
    to_pga,
    to_spectrum,
)
from core.frozen import FrozenDict
from core.isolation_layer.layer import GRAVITY
from core.model.force_response import force_response
from core.model.isolator import Conditions, Isolator
from core.model.simulation import Axis, Response, respond
from core.record import Direction
from core.rounding import plain
from core.shaking.floors import STIFFNESS_ERROR
from core.signals.conditioning import without_baseline

COVERAGE = 0.95
"""Probability of the intervals."""
AFTERWARDS = 20.0
"""s of rest of the ground behind a motion, in which the building still moves."""
PRIOR_ERROR = 0.02
"""Relative error of a model's peaks that is assumed before any record, with the weight of PRIOR_RECORDS. This and the
next four were chosen on the even seeds of buildings with a hidden effect (docs/models/forecasts.md)."""
PRIOR_RECORDS = 4.0
"""Number of records that PRIOR_ERROR counts for."""
HISTORY = 0.5
"""Error of a peak over the error of its history, both relative. It is added to the errors of the peaks, which alone are
too few: one may be small by chance."""
GROWTH = 0.1
"""Relative error of a peak that is added per e-fold of the isolators' displacement beyond that of the records."""
FARTHEST = 2.5
"""Displacement, or velocity, over the largest in the records, from which on a forecast is out of range."""
AWAKE = 1e-2
"""Share of the force that the value of an effect changes, from which on the effect acts. A choice."""
FACTORS = (1e-3, 1e3)
"""Smallest and largest factor of a ground motion."""
SLACK = 5.0
"""°C beyond the records' temperatures that are still in range of a model with temperature. A choice."""

Quantity = Literal["displacement", "acceleration", "drift"]


@dataclass(frozen=True, slots=True)
class Peak:
    """Largest absolute value of one quantity, with its 95 % interval."""

    quantity: Quantity
    level: str
    """Level of an acceleration; for a drift, the floor above the storey; empty for the isolation layer."""
    direction: str
    """x or y; xy for a displacement in plan."""
    value: float
    """m, of a displacement, or of a drift relative to the level below; m/s², absolute, of an acceleration."""
    low: float
    high: float
    by_values: float
    """Standard deviation by the covariance of the model's values, over the value."""
    by_model: float
    """The same by the model's own error."""


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Response of layer and floors in one direction."""

    response: Response
    displacement_std: Vector
    """(n,) m, of the layer's displacement, by the covariance of the values alone."""


@dataclass(frozen=True, slots=True, eq=False)
class Forecast:
    """Response of the building to one ground motion."""

    motion: GroundMotion
    """As scaled."""
    factor: float
    """By which the given motion was multiplied."""
    rate: float
    """Hz, of every history, which begin with the motion."""
    courses: Mapping[Direction, Course]
    peaks: tuple[Peak, ...]
    velocity: float
    """m/s, largest of the layer in a direction."""
    beyond: tuple[str, ...]
    """Reasons why the motion is out of the range that the model has seen; its intervals cannot be relied upon."""
    remarks: tuple[str, ...]
    """Assumptions, and where it goes beyond the records but not out of range."""

    @property
    def is_out_of_range(self) -> bool:
        """True if the records say nothing of the model's error in this motion."""
        return bool(self.beyond)

    def peak(self, quantity: Quantity, level: str = "", direction: str | None = None) -> Peak:
        """The peak of one quantity; in plan, or in the strongest direction, where none is given."""
        own = [one for one in self.peaks if (one.quantity, one.level) == (quantity, level)]
        if direction is not None:
            own = [one for one in own if one.direction == direction]
        return max(own, key=lambda one: one.value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """Time and temperature of a forecast."""

    at: datetime | None = None
    """Start of the motion, aware; None for the end of the last record."""
    temperature: float | None = None
    """°C, of the isolators; None for the mean of the records' lowest and highest."""


USUAL = Setting()
"""Right after the last record, at the records' temperature."""


@dataclass(frozen=True, slots=True, eq=False)
class Forecaster:
    """A model of a building with all that its records teach."""

    model: Isolator
    directions: tuple[Direction, ...]
    """Horizontal directions of the model."""
    description: BuildingDescription
    experience: Experience
    reference: datetime
    """Instant from which effects count time."""

    def forecast(self, motion: GroundMotion, scaling: Scaling | None = None, setting: Setting = USUAL) -> Forecast:
        """The response to one ground motion.

        Args:
            motion: of the ground below the isolators.
            scaling: None for the motion as it is.
            setting: time and temperature.

        Raises:
            RecordError: the motion has no component of the model, the scaling cannot be met, or the time lies before
                the end of the records.
            ModelError: the response grew beyond all bounds.
        """
        usable = self._component(motion)
        factor = self._factor(usable, scaling, setting)
        scaled = usable.times(factor)
        driven = self._responses(self.model, scaled, setting)
        moved = self._moved(scaled, setting)
        return _forecast(self, scaled, factor, driven, moved, setting)

    def _component(self, motion: GroundMotion) -> GroundMotion:
        """The motion in the model's directions."""
        there = [direction for direction in self.directions if direction in motion.accelerations]
        if not there:
            raise RecordError(
                f"{motion.name}: it has the direction {' and '.join(motion.horizontal)}, the model is of "
                f"{' and '.join(self.directions)}; give a motion of that direction"
            )
        return motion.only(there[0]) if len(there) == 1 else motion

    def _factor(self, motion: GroundMotion, scaling: Scaling | None, setting: Setting) -> float:
        if scaling is None:
            return 1.0
        if isinstance(scaling, ToPga):
            return to_pga(motion, scaling)
        if isinstance(scaling, ToDisplacement):
            return self._to_displacement(motion, scaling, setting)
        return to_spectrum(motion, scaling, self.experience.period)

    def _to_displacement(self, motion: GroundMotion, wanted: ToDisplacement, setting: Setting) -> float:
        """The smallest factor, of those tried by doubling, at which the isolators move as far as wanted."""

        def over(logarithm: float) -> float:
            driven = self._responses(self.model, motion.times(exp(logarithm)), setting)
            return log(_in_plan(list(driven.values())) / wanted.value)

        low = high = 0.0
        at_low = at_high = over(0.0)
        while at_high < 0 or at_low > 0:
            low, high = (low, high + log(2)) if at_high < 0 else (low - log(2), high)
            if not log(FACTORS[0]) < low <= high < log(FACTORS[1]):
                raise RecordError(
                    f"{motion.name}: no factor of this motion moves the isolators by {plain(wanted.value * 1e3, 3)} "
                    "mm; give a displacement that this motion can cause"
                )
            if at_high < 0:
                low, at_low, at_high = high - log(2), at_high, over(high)
            else:
                high, at_high, at_low = low + log(2), at_low, over(low)
        return (
            exp(scipy.optimize.brentq(over, low, high, xtol=1e-4))
            if at_low < 0 < at_high
            else exp(low if at_low == 0 else high)
        )

    def _responses(self, model: Isolator, motion: GroundMotion, setting: Setting) -> dict[Direction, Response]:
        directions = [one for one in self.directions if one in motion.accelerations]
        lacking = [one for one in directions if one not in self.experience.superstructures]
        if lacking:
            raise RecordError(f"the superstructure in direction {' and '.join(lacking)} is not known")
        axes = [self._axis(direction, motion, setting) for direction in directions]
        responses = respond(axes, self.description.base_mass, model, motion.rate)
        return dict(zip(directions, responses, strict=True))

    def _axis(self, direction: Direction, motion: GroundMotion, setting: Setting) -> Axis:
        ground = _followed(without_baseline(motion.accelerations[direction], motion.rate), motion.rate)
        return Axis(
            self.experience.superstructures[direction],
            ground,
            self.conditions(motion, ground.size, setting),
            self.experience.states.get(direction),
        )

    def conditions(self, motion: GroundMotion, count: int, setting: Setting) -> Conditions:
        """Conditions of the layer in a forecast of that many samples, without motion in the other direction."""
        begun = setting.at or self.experience.last
        if begun.tzinfo is None:
            raise RecordError(f"the time {begun} has no time zone; give it one, such as UTC")
        if begun < self.experience.last:
            raise RecordError(
                f"the time of the forecast, {begun:%Y-%m-%d %H:%M:%S}, lies before the end of the last record, "
                f"{self.experience.last:%Y-%m-%d %H:%M:%S} UTC; give a later time, or fewer records"
            )
        vertical = motion.accelerations.get("z")
        load = np.zeros(count) if vertical is None else _followed(without_baseline(vertical, motion.rate), motion.rate)
        return Conditions(
            u_cross=np.zeros(count),
            v_cross=np.zeros(count),
            axial_load=1 + load / GRAVITY,
            temperature=np.full(count, self.temperature(setting)),
            time=(begun - self.reference).total_seconds() + np.arange(count) / motion.rate,
            ground=np.zeros(count),
        )

    def temperature(self, setting: Setting) -> float:
        """°C, of the isolators in a forecast."""
        if setting.temperature is None:
            low, high = self.experience.temperatures
            return (low + high) / 2
        if not -60 <= setting.temperature <= 100:
            raise RecordError(
                f"the temperature of the isolators must be within −60 ... 100 °C, got {setting.temperature:g}"
            )
        return setting.temperature

    def _moved(self, motion: GroundMotion, setting: Setting) -> list[tuple[dict[Direction, Response], ...]]:
        """Responses a step of the values to either side, for every step of their covariance."""
        return [
            tuple(
                self._responses(self.experience.spread.moved(self.model, step, sign), motion, setting)
                for sign in (-1.0, 1.0)
            )
            for step in range(self.experience.spread.lengths.size)
        ]


def _followed(samples: Vector, rate: float) -> Vector:
    """The samples with a time of rest behind them."""
    return np.concatenate([samples, np.zeros(round(AFTERWARDS * rate))])


def _in_plan(responses: Sequence[Response]) -> float:
    """m, largest displacement of the layer, of one direction or in plan."""
    return float(np.sqrt(np.sum([one.isolator_displacement**2 for one in responses], axis=0)).max())


def _forecast(
    by: Forecaster,
    motion: GroundMotion,
    factor: float,
    driven: Mapping[Direction, Response],
    moved: Sequence[tuple[Mapping[Direction, Response], ...]],
    setting: Setting,
) -> Forecast:
    amplitude = max(float(np.abs(one.isolator_displacement).max()) for one in driven.values())
    velocity = max(float(np.abs(one.isolator_velocity).max()) for one in driven.values())
    peaks = tuple(_peaks(by, driven, moved, amplitude))
    courses = {
        direction: Course(response, _displacement_std(by, direction, moved, response))
        for direction, response in driven.items()
    }
    return Forecast(
        motion=motion,
        factor=factor,
        rate=motion.rate,
        courses=FrozenDict(courses),
        peaks=peaks,
        velocity=velocity,
        beyond=tuple(_beyond(by, driven, motion, amplitude, velocity, setting)),
        remarks=tuple(_remarks(by, motion, amplitude)),
    )


def _displacement_std(
    by: Forecaster, direction: Direction, moved: Sequence[tuple[Mapping[Direction, Response], ...]], at: Response
) -> Vector:
    squares = np.zeros(at.isolator_displacement.size)
    for (below, above), length in zip(moved, by.experience.spread.lengths, strict=True):
        squares += (length / 2 * (above[direction].isolator_displacement - below[direction].isolator_displacement)) ** 2
    return np.asarray(np.sqrt(squares))


def _values_of(by: Forecaster, driven: Mapping[Direction, Response]) -> Iterator[tuple[Quantity, str, str, float]]:
    """Quantity, level, direction and largest absolute value of all that is forecast."""
    for direction, one in driven.items():
        yield "displacement", "", direction, float(np.abs(one.isolator_displacement).max())
    if len(driven) > 1:
        yield "displacement", "", "xy", _in_plan(list(driven.values()))
    floors = [level.name for level in by.description.floors]
    for direction, one in driven.items():
        levels = [by.description.base.name, *floors]
        for level, samples in zip(levels, [one.base_acceleration, *one.floor_acceleration], strict=True):
            yield "acceleration", level, direction, float(np.abs(samples).max())
    for direction, one in driven.items():
        drift = np.abs(np.diff(one.floor_displacement, axis=0, prepend=0.0)).max(axis=1)
        for level, value in zip(floors, drift, strict=True):
            yield "drift", level, direction, float(value)


def _peaks(
    by: Forecaster,
    driven: Mapping[Direction, Response],
    moved: Sequence[tuple[Mapping[Direction, Response], ...]],
    amplitude: float,
) -> Iterator[Peak]:
    central = list(_values_of(by, driven))
    ends = [[list(_values_of(by, side)) for side in pair] for pair in moved]
    for number, (quantity, level, direction, value) in enumerate(central):
        changes = [
            length / 2 * log(above[number][3] / below[number][3]) if above[number][3] > 0 < below[number][3] else 0.0
            for (below, above), length in zip(ends, by.experience.spread.lengths, strict=True)
        ]
        by_values = sqrt(sum(change**2 for change in changes))
        by_model, freedom = own_error(by.experience.misses, quantity, level, amplitude, by.experience.displacement)
        reach = float(scipy.stats.t.ppf((1 + COVERAGE) / 2, freedom)) * hypot(by_values, by_model)
        yield Peak(quantity, level, direction, value, value * exp(-reach), value * exp(reach), by_values, by_model)


def own_error(
    misses: Sequence[Miss], quantity: Quantity, level: str, amplitude: float, seen: float
) -> tuple[float, float]:
    """Relative standard deviation of a peak by the model's own error, and its degrees of freedom.

    Args:
        misses: of the model in the records.
        quantity: of the peak.
        level: of the peak.
        amplitude: m, largest displacement of the layer in the forecast.
        seen: m, the same in the records.
    """
    kind: Kind = "displacement" if quantity == "displacement" else "acceleration"
    alike = [one for one in misses if one.kind == kind]
    own = [one for one in alike if one.level == level] or alike
    weights = [min(1.0, one.amplitude / amplitude) for one in own]
    squares = [one.peak**2 + (HISTORY * one.history) ** 2 for one in own]
    levels = max(1, len({one.level for one in own}))
    count = sum(weights) / levels
    total = sum(weight * square for weight, square in zip(weights, squares, strict=True)) / levels
    error = sqrt((PRIOR_RECORDS * PRIOR_ERROR**2 + total) / (PRIOR_RECORDS + count))
    farther = GROWTH * max(0.0, log(amplitude / seen))
    unknown = STIFFNESS_ERROR if quantity == "drift" else 0.0
    return sqrt(error**2 + farther**2 + unknown**2), PRIOR_RECORDS + count


def _beyond(
    by: Forecaster,
    driven: Mapping[Direction, Response],
    motion: GroundMotion,
    amplitude: float,
    velocity: float,
    setting: Setting,
) -> Iterator[str]:
    seen = by.experience
    if amplitude > FARTHEST * seen.displacement:
        yield (
            f"The isolators would move {plain(amplitude * 1e3, 3)} mm, {plain(amplitude / seen.displacement, 2)} times "
            f"as far as in any record that the model was fitted to ({plain(seen.displacement * 1e3, 3)} mm)."
        )
    if velocity > FARTHEST * seen.velocity:
        yield (
            f"They would move at {plain(velocity * 1e3, 3)} mm/s, {plain(velocity / seen.velocity, 2)} times as fast "
            f"as in any record that the model was fitted to ({plain(seen.velocity * 1e3, 3)} mm/s)."
        )
    if awake := _awake(by, driven, motion, setting):
        yield f"No record has made this act: {', '.join(awake)}. Here it would; its values are not known."
    temperature, (low, high) = by.temperature(setting), seen.temperatures
    if _needs(by.model, "temperature") and not low - SLACK <= temperature <= high + SLACK:
        yield (
            f"The isolators would have {plain(temperature, 3)} °C; the records have {plain(low, 3)} to "
            f"{plain(high, 3)} °C."
        )


def _needs(model: Isolator, condition: str) -> bool:
    return any(condition in EFFECTS[name].needs for name in model.effects)


def _awake(
    by: Forecaster, driven: Mapping[Direction, Response], motion: GroundMotion, setting: Setting
) -> tuple[str, ...]:
    """Effects of which no record determines a value, and that act in this motion."""
    keys = by.experience.asleep
    if not keys:
        return ()
    found: dict[str, None] = {}
    for direction, one in driven.items():
        conditions = by.conditions(motion, one.force.size, setting)
        if across := driven.get(CROSS[direction]):
            conditions = replace(conditions, u_cross=across.isolator_displacement, v_cross=across.isolator_velocity)
        answer = force_response(
            by.model,
            one.isolator_displacement,
            one.isolator_velocity,
            motion.rate,
            conditions=conditions,
            wanted=keys,
            states=by.experience.states.get(direction),
        )
        size = float(np.linalg.norm(answer.force))
        for key, row in zip(keys, answer.by_parameter, strict=True):
            if float(np.linalg.norm(row)) * typical(by.model, key) > AWAKE * size:
                found[key[0]] = None
    return tuple(found)


def _remarks(by: Forecaster, motion: GroundMotion, amplitude: float) -> Iterator[str]:
    seen = by.experience
    if seen.displacement < amplitude <= FARTHEST * seen.displacement:
        yield (
            f"The isolators would move {plain(amplitude / seen.displacement, 3)} times as far as in any record that "
            f"the model was fitted to ({plain(seen.displacement * 1e3, 3)} mm); the interval is wider for it."
        )
    lacking = [direction for direction in by.directions if direction not in motion.accelerations]
    if lacking:
        yield f"The motion has no component in direction {' and '.join(lacking)}; the isolators are at rest there."
    if len(by.directions) == 1 and any(_needs(by.model, name) for name in ("u_cross", "v_cross")):
        yield "An effect couples the directions, and the model is of one; the isolators are at rest in the other."
    if _needs(by.model, "axial_load") and "z" not in motion.accelerations:
        yield "The motion has no vertical component; the load on the isolators is that at rest."
    if not seen.misses:
        yield "No record shows the ground's motion, so the model's own error is assumed, not measured."
