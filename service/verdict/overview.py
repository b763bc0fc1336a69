"""The stored facts behind the assessments of many buildings, by a fixed number of statements.

Each statement is made once and runs with the numbers of buildings, events and analyses as parameters: to make one takes
longer than to run it for a page of fifty buildings.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cache
from math import inf
from typing import Any

from sqlalchemy import ScalarSelect, exists, func, select
from sqlalchemy.orm import Session, aliased, defer, load_only

from service.alerts.tables import Alert, BuildingInspection
from service.analyses import history
from service.analyses.tables import Analysis, DirectionResult, LayerResult, ShakingResult
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building, Revision
from service.db.select import Line, Question, numbers
from service.drift.tables import DriftValue, MonitoredSeries
from service.jobs.queue import UNDER_WAY, WATCH
from service.jobs.tables import Job
from service.records.tables import Event
from service.verdict.accumulated import Totals, totals
from service.verdict.limits import STIFFNESS_CHANGE, TOLERANCE

UNUSABLE = ("refused", "failed")
"""States of an event without a usable record."""
BUILDINGS, EVENTS, ANALYSES = (numbers(name) for name in ("buildings", "events", "analyses"))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class StoredFacts:
    """Stored facts about an earthquake and its building, besides the event and its analysis."""

    file: BuildingFile
    results: Sequence[DirectionResult]
    """Directions of the analysis; empty without one."""
    layer: LayerResult | None
    shaking: ShakingResult | None
    """None of an analysis by an earlier version."""
    totals: Totals | None
    """Sums over this earthquake and all before; None without one."""
    largest_earlier: float | None
    """m, largest displacement in plan in the earthquakes before; None where none was measured."""
    stiffness: Sequence[tuple[Any, ...]]
    """(subject, events that the reference lacks, history.corrections, DriftValue | None) by series."""
    is_being_compared: bool
    """True while the comparison with earlier earthquakes has not finished."""
    alerts: Sequence[tuple[Alert, str]]
    """Open alerts with their states, by number."""
    inspection: BuildingInspection | None = None
    """The latest of the building; None where there is none, or it is not asked for."""
    unseen: tuple[int, datetime] | None = None
    """Number of earlier earthquakes without a usable record since the latest inspection, and start of the last."""

    @property
    def tolerance(self) -> float:
        """Relative change of stiffness beyond which the isolators are to be inspected."""
        given = self.file.limits.get(STIFFNESS_CHANGE)
        return TOLERANCE if given is None else given.inspect or given.act or inf


def last_events(session: Session, buildings: Collection[int]) -> Sequence[Line]:
    """(Building, its last Event | None, the event's latest Analysis | None) of the buildings of these numbers.

    Of the analysis, only what an assessment uses is read.
    """
    return session.execute(_last(), {"buildings": buildings}).all()


def stored_facts(session: Session, lines: Sequence[Line]) -> Mapping[int, StoredFacts]:
    """The facts of each building and its last earthquake, by number of the building; `lines` as of `last_events`."""
    buildings = [one.Building.id for one in lines]
    of_event = {one.Event.id: one.Building.id for one in lines if one.Event is not None}
    of_analysis = {one.Analysis.id: one.Building.id for one in lines if one.Analysis is not None}
    given = {"buildings": buildings, "events": list(of_event), "analyses": list(of_analysis)}

    def of_buildings(question: Question) -> Mapping[int, list[Line]]:
        return _grouped(session.execute(question, given))

    def of_analyses(question: Question) -> Mapping[int, list[Any]]:
        rows: dict[int, list[Any]] = defaultdict(list)
        for one in session.scalars(question, given):
            rows[of_analysis[one.analysis_id]].append(one)
        return rows

    results, layers, shaken = of_analyses(_directions()), of_analyses(_layers()), of_analyses(_shaken())
    alerts, stiffness = of_buildings(_open_alerts()), of_buildings(_stiffness())
    largest = {line[0]: line[1] for line in session.execute(_largest_earlier(), given)}
    inspected = {one.building_id: one for one in session.scalars(_inspections(), given)}
    unseen = {line[0]: (line[1], line[2]) for line in session.execute(_unseen(), given)}
    compared = set(session.scalars(_being_compared(), given))
    summed = {building: sums for _, building, sums in totals(session, buildings, given["events"])}
    return {
        number: StoredFacts(
            file=building_store.parsed(revision),
            results=results[number],
            layer=next(iter(layers[number]), None),
            shaking=next(iter(shaken[number]), None),
            totals=summed.get(number),
            largest_earlier=largest.get(number),
            stiffness=[tuple(line[1:]) for line in stiffness[number]],
            is_being_compared=number in compared,
            alerts=[(line[1], line[1].state) for line in alerts[number]],
            inspection=inspected.get(number),
            unseen=unseen.get(number),
        )
        for number, revision in session.execute(_revisions(), given)
    }


def _grouped(lines: Iterable[Line]) -> Mapping[int, list[Line]]:
    """Lines by their first column."""
    grouped: dict[int, list[Line]] = defaultdict(list)
    for line in lines:
        grouped[line[0]].append(line)
    return grouped


def _last_event() -> ScalarSelect[Any]:
    """Number of the last event of a building of the question around it."""
    of_building = aliased(Event)
    latest = select(of_building.id).where(of_building.building_id == Building.id).correlate(Building)
    return latest.order_by(of_building.start.desc(), of_building.id.desc()).limit(1).scalar_subquery()


@cache
def _last() -> Question:
    question = select(Building, Event, Analysis).select_from(Building).outerjoin(Event, Event.id == _last_event())
    with_analysis = question.outerjoin(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
    of_analysis = load_only(Analysis.event_id, Analysis.refusal, Analysis.quality)
    return with_analysis.where(Building.id.in_(BUILDINGS)).options(of_analysis)


@cache
def _directions() -> Question:
    peak, residual = "peak_displacement", "residual_displacement"
    read = _of_analyses(DirectionResult, "direction", peak, f"{peak}_std", residual, f"{residual}_std")
    return read.order_by(DirectionResult.direction)


@cache
def _layers() -> Question:
    return _of_analyses(LayerResult, "peak_resultant")


@cache
def _shaken() -> Question:
    columns = ("level", "is_below_isolators", "components", "intensity", "long_period_velocity", "floors", "storeys")
    return _of_analyses(ShakingResult, *columns)


def _of_analyses(table: type[DirectionResult | LayerResult | ShakingResult], *columns: str) -> Question:
    """Results of the analyses, of which only these columns are read: the others take most of the time."""
    only = load_only(table.analysis_id, *(getattr(table, one) for one in columns))
    return select(table).where(table.analysis_id.in_(ANALYSES)).options(only)


@cache
def _open_alerts() -> Question:
    is_open = (Alert.building_id.in_(BUILDINGS), Alert.closed_at.is_(None))
    return select(Alert.building_id, Alert).where(*is_open).order_by(Alert.id)


@cache
def _revisions() -> Question:
    other = aliased(Revision)
    newest = select(func.max(other.number)).where(other.building_id == Revision.building_id).scalar_subquery()
    of_buildings = (Revision.building_id.in_(BUILDINGS), Revision.number == newest)
    return select(Revision.building_id, Revision).where(*of_buildings)


@cache
def _stiffness() -> Question:
    value = (DriftValue.series_id == MonitoredSeries.id) & (DriftValue.event_id == _last_event())
    question = select(MonitoredSeries.building_id, MonitoredSeries.subject, MonitoredSeries.wanted)
    question = question.add_columns(*history.corrections(), DriftValue).options(defer(DriftValue.causes))
    question = question.join(Building, Building.id == MonitoredSeries.building_id).outerjoin(DriftValue, value)
    of_stiffness = (MonitoredSeries.building_id.in_(BUILDINGS), MonitoredSeries.quantity == "stiffness")
    return question.where(*of_stiffness).order_by(MonitoredSeries.subject)


@cache
def _largest_earlier() -> Question:
    """(number of the building, m) from the usable analyses of the events before the last one."""
    moved = func.coalesce(LayerResult.peak_resultant, DirectionResult.peak_displacement)
    return (
        _earlier(Event.building_id, func.max(moved))
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current & Analysis.refusal.is_(None))
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .outerjoin(LayerResult, LayerResult.analysis_id == Analysis.id)
    )


@cache
def _inspections() -> Question:
    """The latest inspection of each building."""
    other = aliased(BuildingInspection)
    of_building = select(other.id).where(other.building_id == BuildingInspection.building_id)
    latest = of_building.order_by(other.inspected_at.desc(), other.id.desc()).limit(1).scalar_subquery()
    of_buildings = BuildingInspection.building_id.in_(BUILDINGS)
    return select(BuildingInspection).where(of_buildings, BuildingInspection.id == latest)


@cache
def _unseen() -> Question:
    """(number of the building, count, start of the last) of the events without a usable record before the last event.

    An inspection settles those before it.
    """
    of_building = BuildingInspection.building_id == Event.building_id
    inspected = exists().where(of_building, BuildingInspection.inspected_at >= Event.end)
    counted = _earlier(Event.building_id, func.count(), func.max(Event.start))
    return counted.where(Event.state.in_(UNUSABLE), ~inspected)


def _earlier(*columns: Any) -> Question:  # noqa: ANN401  SQLAlchemy's
    """Query of columns of the events before the last one of each building, grouped by building."""
    last = aliased(Event)
    joined = select(*columns).join(last, last.building_id == Event.building_id)
    return joined.where(last.id.in_(EVENTS), Event.start < last.start).group_by(Event.building_id)


@cache
def _being_compared() -> Question:
    """Numbers of the buildings whose latest comparison with earlier earthquakes waits or is under way."""
    later = aliased(Job)
    is_latest = ~exists().where(later.kind == WATCH, later.building_id == Job.building_id, later.id > Job.id)
    return select(Job.building_id).where(
        Job.kind == WATCH, Job.building_id.in_(BUILDINGS), Job.state.in_(UNDER_WAY), is_latest
    )
