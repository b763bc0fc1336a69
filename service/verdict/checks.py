"""Checks: a value with its uncertainty against limits.

With the size x of a value, its uncertainty u (95 %) and a limit L: exceeded where x - u >= L, passed where x + u < L,
else undecided. A value that is missing, may be larger than measured, or has no limit is undecided too: a check never
passes by default.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from math import isfinite


class Level(StrEnum):
    """Levels of a verdict, the gravest first."""

    ACT = "act"
    INSPECT = "inspect"
    NO_DATA = "no_data"
    UNDECIDED = "undecided"
    WATCH = "watch"
    NORMAL = "normal"

    @property
    def words(self) -> str:
        """The level as people read it."""
        return "no data" if self is Level.NO_DATA else self.value

    @property
    def rank(self) -> int:
        """0 for normal, 5 for act."""
        return len(LEVELS) - 1 - LEVELS.index(self)


LEVELS = tuple(Level)
COVERAGE = 2.0
"""Standard deviations of the 95 % uncertainty."""


class Outcome(StrEnum):
    """Outcomes of a check."""

    PASSED = "passed"
    EXCEEDED = "exceeded"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """A value that is checked."""

    value: float
    """Its absolute value is checked."""
    uncertainty: float | None
    """95 %, the same unit; None where it is not known."""
    note: str = ""
    """Place of the value, or how far its determination goes."""
    doubt: str = ""
    """Reason why the true value may exceed the measured one and its uncertainty; empty if it may not."""
    remedy: str = ""
    """Action that removes the doubt."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lacking:
    """A missing value or limit: the reason, and the remedy."""

    reason: str
    remedy: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """Limits of a check in the unit of its value, rising; None where there is none of that level."""

    watch: float | None = None
    inspect: float | None = None
    act: float | None = None
    source: str
    """Source of the limits, for display."""

    def __iter__(self) -> Iterator[tuple[Level, float]]:
        """Each with the level that it leads to, the lowest first."""
        for level, limit in ((Level.WATCH, self.watch), (Level.INSPECT, self.inspect), (Level.ACT, self.act)):
            if limit is not None:
                yield level, limit


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One check and its outcome."""

    name: str
    """`shear_strain`, `stiffness` ..."""
    subject: str = ""
    """Direction; empty where the check is about the whole layer, or the records."""
    outcome: Outcome
    level: Level
    """Level that the check alone leads to: normal where it is passed."""
    unit: str = "1"
    """SI unit of the value and the limits."""
    note: str = ""
    """Place of the value, or how far its determination goes; empty where nothing is to be said."""
    value: float | None = None
    uncertainty: float | None = None
    """95 %; None where there is no value, or its uncertainty is not known."""
    limits: Limits | None = None
    limit: float | None = None
    """The highest limit that is exceeded; if none is, the lowest that is not passed; if all are passed, the lowest."""
    reason: str = ""
    """Reason why it is undecided or exceeded, if the numbers alone do not show it."""
    remedy: str = ""
    """Action that settles it, where it is undecided."""


NO_UNCERTAINTY = "The uncertainty of the value is not known."
WITHIN_UNCERTAINTY = "The limit lies within the uncertainty of the value."
"""Reasons why a value is not decided that is no lower bound."""
NOT_A_NUMBER = Lacking(reason="The value is not a number.", remedy="Analyse the earthquake again.")


def gravest(levels: Iterable[Level]) -> Level:
    """The gravest of some levels; undecided where there is none."""
    return min(levels, key=LEVELS.index, default=Level.UNDECIDED)


def checked(
    name: str, measured: Measured | Lacking, limits: Limits | Lacking, *, unit: str = "1", subject: str = ""
) -> Check:
    """A value against its limits.

    An act limit that cannot be decided on a value that is known leads to `inspect`; a value that is only a lower bound,
    or whose uncertainty is not known, leads to `undecided`.
    """
    if isinstance(limits, Lacking):
        known = measured if isinstance(measured, Measured) and isfinite(measured.value) else None
        return undecided(name, limits, measured=known, unit=unit, subject=subject)
    if isinstance(measured, Lacking):
        return undecided(name, measured, limits=limits, unit=unit, subject=subject)
    if not isfinite(measured.value):
        return undecided(name, NOT_A_NUMBER, limits=limits, unit=unit, subject=subject)
    exceeded, unclear = _against(measured, limits)
    outcome = Outcome.EXCEEDED if exceeded else Outcome.UNDECIDED if unclear else Outcome.PASSED
    deciding: float | None
    if exceeded:
        deciding = max(exceeded.values())
    else:
        deciding = min(unclear.values() if unclear else (limit for _, limit in limits), default=None)
    return Check(
        name=name,
        subject=subject,
        outcome=outcome,
        level=_level(measured, exceeded.keys(), unclear.keys()),
        unit=unit,
        value=measured.value,
        uncertainty=measured.uncertainty,
        note=measured.note,
        limits=limits,
        limit=deciding,
        reason=_doubt(measured) if unclear else "",
        remedy=_remedy(measured) if unclear else "",
    )


def undecided(
    name: str,
    lacking: Lacking,
    *,
    measured: Measured | None = None,
    limits: Limits | None = None,
    unit: str = "1",
    subject: str = "",
) -> Check:
    """A check of which something is missing."""
    return Check(
        name=name,
        subject=subject,
        outcome=Outcome.UNDECIDED,
        level=Level.UNDECIDED,
        unit=unit,
        value=None if measured is None else measured.value,
        uncertainty=None if measured is None else measured.uncertainty,
        note="" if measured is None else measured.note,
        limits=limits,
        reason=lacking.reason,
        remedy=lacking.remedy,
    )


def _against(measured: Measured, limits: Limits) -> tuple[dict[Level, float], dict[Level, float]]:
    """Limits that are exceeded, and those of which that cannot be decided."""
    u, size = measured.uncertainty, abs(measured.value)
    spread = abs(u) if u is not None and isfinite(u) else 0.0
    is_bounded = u is not None and isfinite(u) and not measured.doubt
    exceeded, unclear = {}, {}
    for level, limit in limits:
        if size - spread >= limit:
            exceeded[level] = limit
        elif not (is_bounded and size + spread < limit):  # a limit that is no number is never passed
            unclear[level] = limit
    return exceeded, unclear


def _level(measured: Measured, exceeded: Iterable[Level], unclear: Iterable[Level]) -> Level:
    levels, open_ = set(exceeded), set(unclear)
    if open_:
        is_known = not measured.doubt and measured.uncertainty is not None and isfinite(measured.uncertainty)
        levels.add(Level.INSPECT if Level.ACT in open_ and is_known else Level.UNDECIDED)
    return gravest(levels or {Level.NORMAL})


def _doubt(measured: Measured) -> str:
    if measured.doubt:
        return measured.doubt
    if measured.uncertainty is None or not isfinite(measured.uncertainty):
        return NO_UNCERTAINTY
    return WITHIN_UNCERTAINTY


def _remedy(measured: Measured) -> str:
    return measured.remedy or "A judgement by the engineer, or a better measurement."
