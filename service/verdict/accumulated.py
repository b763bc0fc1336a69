"""Sums over the earthquakes of a building: the offset that each left, and the path of the isolators."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from math import sqrt
from typing import Any

from sqlalchemy import ColumnElement, ScalarSelect, and_, case, exists, func, or_, select
from sqlalchemy.orm import Session, aliased

from service.alerts.tables import BuildingInspection
from service.analyses.tables import Analysis, DirectionResult, ShakingResult
from service.buildings.tables import Building
from service.db.select import Line, Question, numbers
from service.drift.tables import ReferencePeriod
from service.records.tables import Event
from service.verdict.checks import Lacking, Measured
from service.verdict.measured import DIRECTIONS, NO_DISPLACEMENT, NO_RESIDUAL, measured_residual
from service.verdict.shaking import CALIBRATION

RESIDUAL = "residual_displacement"
"""Quantity of core.drift.quantities whose reference period begins at the rest position that sums count from."""
TRAVEL = "travel"
SURVEY = (
    "Analyse them again; or inspect the building; or survey the rest position, then set a reference period of "
    f"{RESIDUAL} that begins after the survey."
)
NOTHING_COUNTS = Lacking(
    reason=f"The reference period of {RESIDUAL} begins after this earthquake, which does not count.",
    remedy="The next earthquake is the first that counts.",
)
DAMPERS = "Analyse them again, or inspect the dampers and record the inspection of the building."


@dataclass(frozen=True, slots=True, kw_only=True)
class Total:
    """A sum over earthquakes; one whose share is not known lacks in it."""

    value: float
    """m."""
    variance: float
    """m², of the errors of single earthquakes."""
    count: int
    """Earthquakes with a known share."""
    first: datetime | None
    """Start of the first of them."""
    unknown: int
    """Earthquakes without a known share and without an inspection since."""
    last_unknown: datetime | None
    inspected: int
    """Earthquakes without a known share that an inspection followed."""
    before: int
    """Earthquakes before the reference period, which do not count."""


Totals = Mapping[str, Total]
"""By direction, of the residual displacements since the reference period began; and of the travel."""


def totals(
    session: Session, buildings: Collection[int], events: Collection[int] | None = None
) -> Sequence[tuple[int, int, Totals]]:
    """(event, building, the sums up to the event and with it) of some events, the earliest first, by one statement.

    Args:
        session: to read with.
        buildings: numbers of the buildings that the events belong to.
        events: numbers of the events; None: all of the buildings'.
    """
    given: dict[str, Collection[int]] = {"buildings": buildings}
    if events is not None:
        given["events"] = events
    lines = session.execute(_every_sum() if events is None else _sums_of_events(), given)
    return [(line.id, line.building_id, {name: _total(line, name) for name in (*DIRECTIONS, TRAVEL)}) for line in lines]


def rest_position(sums: Totals) -> Measured | Lacking:
    """m, offset in plan from the rest position at the beginning of the reference period."""
    of_directions = {name: sums[name] for name in DIRECTIONS if sums[name].count}
    if not of_directions:
        each = [sums[name] for name in DIRECTIONS]
        is_lacking = any(one.unknown or one.inspected for one in each)
        return NOTHING_COUNTS if any(one.before for one in each) and not is_lacking else NO_RESIDUAL
    found = measured_residual({name: (one.value, sqrt(one.variance)) for name, one in of_directions.items()})
    worst = max(of_directions.values(), key=lambda one: (one.unknown, one.inspected))
    return _with_doubt(found, worst, "offset", SURVEY)


def travel(sums: Totals) -> Measured | Lacking:
    """m, path of the isolators in plan in all earthquakes; a lower bound where that in one is not known."""
    one = sums[TRAVEL]
    if not one.count:
        return NO_DISPLACEMENT
    found = Measured(value=one.value, uncertainty=CALIBRATION * one.value)  # one gain is wrong in every earthquake
    return _with_doubt(found, one, "path", DAMPERS)


def _with_doubt(found: Measured | Lacking, total: Total, share: str, remedy: str) -> Measured | Lacking:
    """The same with the number of its earthquakes, and with the doubt of those that are not known."""
    if isinstance(found, Lacking):
        return found
    since = "" if total.first is None else f" since {total.first:%Y-%m-%d}"
    counted = f"{_earthquakes(total.count)}{since}"
    note = counted if not total.inspected else f"{counted}, without {total.inspected} not recorded but inspected"
    doubts, remedies = [found.doubt], [found.remedy]
    if total.unknown:
        where = f"The {share} in {_earthquakes(total.unknown)} is not known"
        last = total.last_unknown
        doubts.append(f"{where}." if last is None else f"{where}, the last of {last:%Y-%m-%d %H:%M} UTC.")
        remedies.append(remedy)
    return Measured(
        value=found.value,
        uncertainty=found.uncertainty,
        note=note,
        doubt=" ".join(filter(None, doubts)),
        remedy=" ".join(filter(None, remedies)),
    )


def _earthquakes(count: int) -> str:
    return f"{count} earthquake{'s' if count != 1 else ''}"


def _total(line: Line, name: str) -> Total:
    parts = ("value", "variance", "count", "first", "unknown", "last_unknown", "inspected", "before")
    return Total(**{part: getattr(line, f"{name}_{part}") for part in parts})


@cache
def _sums_of_events() -> Question:
    every = _every_sum()
    return every.where(every.selected_columns.id.in_(numbers("events")))


@cache
def _every_sum() -> Question:
    """Every earthquake of the buildings, with its sums, the earliest first."""
    shares = _shares().cte().prefix_with("MATERIALIZED", dialect="postgresql")  # else each use computes a share again
    order: Mapping[str, Any] = {"partition_by": shares.c.building_id, "order_by": (shares.c.start, shares.c.id)}
    columns: list[ColumnElement[Any]] = []
    for name in (*DIRECTIONS, TRAVEL):
        value, variance = shares.c[name], shares.c[f"{name}_variance"]
        is_known = value.is_not(None) & variance.is_not(None) & shares.c[f"{name}_counts"]
        is_lacking = and_(or_(value.is_(None), variance.is_(None)), shares.c[f"{name}_counts"])
        is_unknown = is_lacking & ~shares.c.is_inspected
        columns += [
            func.sum(case((is_known, value), else_=0.0)).over(**order).label(f"{name}_value"),
            func.sum(case((is_known, variance), else_=0.0)).over(**order).label(f"{name}_variance"),
            func.sum(case((is_known, 1), else_=0)).over(**order).label(f"{name}_count"),
            func.min(case((is_known, shares.c.start))).over(**order).label(f"{name}_first"),
            func.sum(case((is_unknown, 1), else_=0)).over(**order).label(f"{name}_unknown"),
            func.max(case((is_unknown, shares.c.start))).over(**order).label(f"{name}_last_unknown"),
            func.sum(case((is_lacking & shares.c.is_inspected, 1), else_=0)).over(**order).label(f"{name}_inspected"),
            func.sum(case((~shares.c[f"{name}_counts"], 1), else_=0)).over(**order).label(f"{name}_before"),
        ]
    sums = select(shares.c.id, shares.c.building_id, shares.c.start, *columns).subquery()
    return select(sums).order_by(sums.c.start, sums.c.id)


def _shares() -> Question:
    """(id, building_id, start, is_inspected) of every earthquake, and its share in each sum."""
    x, y = (aliased(DirectionResult) for _ in DIRECTIONS)
    since = _references().cte().prefix_with("MATERIALIZED", dialect="postgresql")  # else it is sought for each event
    inspected = exists().where(
        BuildingInspection.building_id == Event.building_id, BuildingInspection.inspected_at >= Event.end
    )
    columns: list[ColumnElement[Any]] = [inspected.label("is_inspected")]
    for name, result in zip(DIRECTIONS, (x, y), strict=True):
        std = result.residual_displacement_std
        columns += [
            result.residual_displacement.label(name),
            (std * std).label(f"{name}_variance"),
            or_(since.c[name].is_(None), Event.start >= since.c[name]).label(f"{name}_counts"),
        ]
    path = ShakingResult.travel
    columns += [path.label(TRAVEL), (0.0 * path).label(f"{TRAVEL}_variance"), (Event.id > 0).label(f"{TRAVEL}_counts")]
    usable = (Analysis.event_id == Event.id) & Analysis.current & Analysis.refusal.is_(None)
    return (
        select(Event.id, Event.building_id, Event.start, *columns)
        .join(since, since.c.id == Event.building_id)
        .outerjoin(Analysis, usable)
        .outerjoin(x, (x.analysis_id == Analysis.id) & (x.direction == DIRECTIONS[0]))
        .outerjoin(y, (y.analysis_id == Analysis.id) & (y.direction == DIRECTIONS[1]))
        .outerjoin(ShakingResult, ShakingResult.analysis_id == Analysis.id)
        .where(Event.building_id.in_(numbers("buildings")))
    )


def _references() -> Question:
    """(id, the start of the reference period in force for each direction) of every building."""
    periods = (_since(name).label(name) for name in DIRECTIONS)
    return select(Building.id, *periods).where(Building.id.in_(numbers("buildings")))


def _since(direction: str) -> ScalarSelect[Any]:
    """Start of the reference period in force (service.buildings.reference_periods.in_force); null: the first event."""
    applies = (
        ReferencePeriod.building_id == Building.id,
        or_(ReferencePeriod.quantity.is_(None), ReferencePeriod.quantity == RESIDUAL),
        or_(ReferencePeriod.subject.is_(None), ReferencePeriod.subject == direction),
    )
    latest = select(ReferencePeriod.start).where(*applies).order_by(ReferencePeriod.id.desc()).limit(1)
    return latest.correlate(Building).scalar_subquery()
