"""The assessment of an earthquake or of a building: checks, open alerts and everything else that weakens a statement.

`assess` is a pure function. `normal` is possible only where every required check passed and nothing is open,
provisional, beyond the limits or beyond what earlier earthquakes showed; nothing is normal by default. An inspection
that a person signed can lower what limits led to, and raise the level; it hides nothing.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum

from core.description import IsolationLayer
from service.buildings.description import GivenLimits
from service.verdict.checks import Check, Lacking, Level, Limits, Measured, Outcome, checked, gravest, undecided
from service.verdict.limits import (
    DESIGN,
    DRIFT,
    FLOOR_ACCELERATION,
    INTENSITY,
    LONG_PERIOD,
    MOAT,
    RESIDUAL_OFFSET,
    REST_POSITION,
    STIFFNESS_CHANGE,
    STRAIN,
    TOLERANCE,
    accumulated_checks,
    limits_of,
    motion_checks,
)
from service.verdict.shaking import ShakingFacts, shaking_checks

LARGEST, DATA, SENSORS, CLOCKS = "largest_so_far", "data_quality", "sensor_health", "clock_health"
REQUIRED = frozenset(
    {
        STRAIN,
        DESIGN,
        MOAT,
        RESIDUAL_OFFSET,
        REST_POSITION,
        DRIFT,
        FLOOR_ACCELERATION,
        INTENSITY,
        LONG_PERIOD,
        LARGEST,
        STIFFNESS_CHANGE,
        DATA,
        SENSORS,
        CLOCKS,
    }
)
"""Names of checks without which nothing is normal."""
HEALTH: Mapping[str, tuple[frozenset[str], str]] = {
    SENSORS: (
        frozenset({"gain", "noise", "channel"}),
        "Repair the sensor or correct it in the building file, and analyse again.",
    ),
    CLOCKS: (frozenset({"clock"}), "Set the clock and check its time signal; analyse again once its times are right."),
}
"""First parts of the causes of alerts about sensors and clocks, and the remedy, by check."""


NO_DIRECTION = Lacking(
    reason="No direction of the isolators is measured.",
    remedy="An accelerometer on the base slab and a displacement transducer.",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenAlert:
    """An alert that has not ended."""

    id: int
    cause: str
    kind: str
    state: str
    summary: str
    low: float | None = None
    high: float | None = None
    """95 % interval of the change; None where it has no size."""
    tolerance: float = TOLERANCE
    """Relative change of stiffness beyond which the isolators are to be inspected."""
    exceeded: Level | None = None
    """Level of the limit that was exceeded; None where the alert is about none."""
    rests_here: bool = False
    """True if its evidence includes the earthquake."""
    is_of_another: bool = False
    """True if its evidence includes the earthquake, and the value in its summary is that of another."""
    is_later: bool = False
    """True if it began after the earthquake."""

    @property
    def level(self) -> Level:
        """Level that the alert alone leads to: `watch` at least.

        A change of stiffness is compared with the tolerance. No tolerance is known of any other change of the building;
        what is under review or on hold is not decided yet; what a sensor measures wrongly cannot be judged. An alert
        that began after the earthquake says nothing of it but that the building is not as before.
        """
        if self.is_later:
            return Level.WATCH
        if self.exceeded is not None:
            return gravest((self.exceeded, Level.WATCH))
        if self.state in ACTIVE:
            if self.kind in ("recovery", "model", "data"):
                return Level.WATCH
            if self.kind == "deterioration" and self.cause.partition("/")[0] == STIFFNESS_CHANGE:
                return _of_change(self.low, self.high, self.tolerance)
        return Level.UNDECIDED


class Result(StrEnum):
    """Results of an inspection of a building."""

    FIT = "fit"
    RESTRICTED = "restricted"
    UNFIT = "unfit"


@dataclass(frozen=True, slots=True, kw_only=True)
class SignedInspection:
    """The latest inspection of a building, and the verdict when it was recorded."""

    by: str
    at: datetime
    result: Result
    comment: str
    level: Level
    """Automatic level when it was recorded."""
    covers: bool
    """True if it was made after the earthquake."""

    @property
    def least(self) -> Level:
        """Level below which the building cannot be while the inspection is the latest."""
        return {Result.FIT: Level.NORMAL, Result.RESTRICTED: Level.INSPECT, Result.UNFIT: Level.ACT}[self.result]

    def level_of(self, check: Check) -> Level:
        """Level that a check leads to beside the inspection.

        An exceeded inspection or action limit falls to `watch` by an inspection made after the earthquake that came
        to fit for normal use; one that cannot be decided, to `undecided`. What is graver than the inspector could know
        of does not fall.
        """
        is_settled = self.result is Result.FIT and self.covers and check.level.rank <= self.level.rank
        if not is_settled or check.level not in (Level.ACT, Level.INSPECT):
            return check.level
        return Level.WATCH if check.outcome is Outcome.EXCEEDED else Level.UNDECIDED


ACTIVE = ("active", "acknowledged")
STATES = ("active", "acknowledged", "pending", "on_hold")
"""In a list of open alerts, active ones come first and those on hold last."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Facts:
    """Everything that an assessment depends on; lengths in m."""

    unusable: str = ""
    """Reason why the earthquake has no usable record, or that there is no earthquake; empty if it has one."""
    silence: str = ""
    """Reason why later earthquakes may have been missed; empty if records arrive."""
    provisional: str = ""
    """Reason why the result is not final; empty if it is."""
    unseen: str = ""
    """Which earlier earthquakes have no usable record and no inspection since; empty if there are none."""
    layer: IsolationLayer
    limits: Mapping[str, GivenLimits] = field(default_factory=dict)
    """The designer's, by check; where there are none, the defaults count."""
    displacement: Measured | Lacking
    """m, largest in plan."""
    residual: Measured | Lacking
    """m, in plan."""
    rest_position: Measured | Lacking
    """m, in plan, sum of the residual displacements since the reference period began."""
    travel: Measured | Lacking
    """m, path of the isolators in plan in this earthquake and all before."""
    shaking: ShakingFacts
    largest_earlier: float | None
    """m, largest displacement in plan in earlier earthquakes; None before the first that was measured."""
    stiffness: Mapping[str, Measured | Lacking]
    """Relative change at equal amplitude and temperature, by direction."""
    data_problems: tuple[str, ...] | Lacking
    """Warnings and fatal findings of the data quality checks, or why they have not been made."""
    sensor_problems: tuple[str, ...] | Lacking
    """Problems of single sensors."""
    clock_problems: tuple[str, ...] | Lacking
    """Problems of clocks."""
    alerts: tuple[OpenAlert, ...]
    inspection: SignedInspection | None = None
    """The latest of the building; None where there is none, and in the verdict on an earthquake."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Assessment:
    """The verdict with everything that it rests on."""

    level: Level
    automatic: Level
    """Level without the inspection."""
    inspection: SignedInspection | None
    checks: tuple[Check, ...]
    """Empty where there is no usable record."""
    alerts: tuple[OpenAlert, ...]
    """The gravest first."""
    unusable: str
    silence: str
    provisional: str
    unseen: str

    @property
    def is_beyond_history(self) -> bool:
        """True if the isolators moved farther than, or not surely less than, in any earlier earthquake."""
        return any(check.name == LARGEST and check.outcome is not Outcome.PASSED for check in self.checks)

    def of_outcome(self, outcome: Outcome) -> tuple[Check, ...]:
        """Checks with that outcome, the gravest first."""
        checks = [check for check in self.checks if check.outcome is outcome]
        return tuple(sorted(checks, key=lambda check: -check.level.rank))


def assess(facts: Facts) -> Assessment:
    """The verdict on an earthquake, or on a building by its last earthquake."""
    checks = () if facts.unusable else tuple(_checks(facts))
    automatic = gravest(_levels(facts, checks, None))
    return Assessment(
        level=automatic if facts.inspection is None else gravest(_levels(facts, checks, facts.inspection)),
        automatic=automatic,
        inspection=facts.inspection,
        checks=checks,
        alerts=tuple(sorted(facts.alerts, key=_order)),
        unusable=facts.unusable,
        silence=facts.silence,
        provisional=facts.provisional,
        unseen=facts.unseen,
    )


def _order(alert: OpenAlert) -> tuple[int, int, int]:
    return STATES.index(alert.state) if alert.state in STATES else 0, -alert.level.rank, alert.id


def _levels(facts: Facts, checks: tuple[Check, ...], inspection: SignedInspection | None) -> Iterator[Level]:
    if facts.unusable or facts.silence:
        yield Level.NO_DATA
    if REQUIRED - {check.name for check in checks} or facts.provisional or facts.unseen:
        yield Level.UNDECIDED
    if inspection is not None:
        yield inspection.least
    yield from (check.level if inspection is None else inspection.level_of(check) for check in checks)
    yield from (alert.level for alert in facts.alerts)


def _checks(facts: Facts) -> Iterator[Check]:
    limits = limits_of(facts.layer, facts.limits)
    yield from motion_checks(facts.layer, limits, facts.displacement, facts.residual)
    yield from accumulated_checks(limits, facts.rest_position, facts.travel)
    yield from shaking_checks(facts.shaking, limits)
    yield checked(LARGEST, facts.displacement, _largest(facts.largest_earlier), unit="m")
    for direction, change in sorted((facts.stiffness or {"": NO_DIRECTION}).items()):
        yield checked(STIFFNESS_CHANGE, change, limits[STIFFNESS_CHANGE], subject=direction)
    yield _free_of(DATA, facts.data_problems, "Correct the data problems and analyse again.")
    yield _health(SENSORS, facts.sensor_problems, facts.alerts)
    yield _health(CLOCKS, facts.clock_problems, facts.alerts)


def _largest(earlier: float | None) -> Limits | Lacking:
    if earlier is None:
        return Lacking(
            reason="There is no earlier earthquake to compare with.",
            remedy="Records of earlier earthquakes, or the engineer's judgement of this first one.",
        )
    return Limits(watch=earlier, source="largest displacement in earlier earthquakes")


def _health(name: str, problems: tuple[str, ...] | Lacking, alerts: tuple[OpenAlert, ...]) -> Check:
    """Check of the sensors or the clocks: findings of the record, and alerts about them that are open.

    An alert that began after the earthquake says nothing of its record.
    """
    about, remedy = HEALTH[name]
    alarmed = tuple(one.summary for one in alerts if one.cause.partition("/")[0] in about and not one.is_later)
    if isinstance(problems, Lacking) and alarmed:
        return _free_of(name, alarmed, remedy)
    return _free_of(name, problems if isinstance(problems, Lacking) else (*problems, *alarmed), remedy)


def _free_of(name: str, problems: tuple[str, ...] | Lacking, remedy: str) -> Check:
    """A check that is passed where there are no problems, else undecided."""
    if isinstance(problems, Lacking):
        return undecided(name, problems)
    if problems:
        more = "" if len(problems) == 1 else f" ({len(problems) - 1} more)"
        return undecided(name, Lacking(reason=f"{problems[0].rstrip('.')}{more}.", remedy=remedy))
    return Check(name=name, outcome=Outcome.PASSED, level=Level.NORMAL)


def _of_change(low: float | None, high: float | None, tolerance: float) -> Level:
    if low is None or high is None:
        return Level.UNDECIDED
    if low >= tolerance or high <= -tolerance:
        return Level.INSPECT
    return Level.WATCH if low > -tolerance and high < tolerance else Level.UNDECIDED
