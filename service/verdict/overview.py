"""The stored facts behind the assessments of many buildings, by a fixed number of statements."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from math import inf
from typing import Any

from sqlalchemy import ScalarSelect, exists, func, select
from sqlalchemy.orm import Session, aliased

from service.alerts.tables import Alert, BuildingInspection
from service.analyses import history
from service.analyses.tables import Analysis, DirectionResult, LayerResult, ShakingResult
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building, Revision
from service.db.select import Line, Question
from service.drift.tables import DriftValue, MonitoredSeries
from service.jobs.queue import UNDER_WAY, WATCH
from service.jobs.tables import Job
from service.records.tables import Event
from service.verdict.accumulated import Totals, totals
from service.verdict.limits import STIFFNESS_CHANGE, TOLERANCE

UNUSABLE = ("refused", "failed")
"""States of an event without a usable record."""


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


def last_events(session: Session, buildings: Question) -> Sequence[Line]:
    """(Building, its last Event | None, the event's latest Analysis | None) of these buildings."""
    return session.execute(_last(buildings.correlate(None))).all()


def stored_facts(session: Session, buildings: Question) -> Mapping[int, StoredFacts]:
    """The facts of each building and its last earthquake, by number of the building."""
    buildings = buildings.correlate(None)  # else a selection of every building would take the rows of the question
    of_last = _last(buildings).with_only_columns(Analysis.id)
    results = _grouped(session, _with_building(DirectionResult, of_last).order_by(DirectionResult.direction))
    layers = _grouped(session, _with_building(LayerResult, of_last))
    shaken = _grouped(session, _with_building(ShakingResult, of_last))
    alerts = _grouped(session, select(Alert.building_id, Alert).where(*_open(buildings)).order_by(Alert.id))
    stiffness = _grouped(session, _stiffness(buildings))
    largest = {line[0]: line[1] for line in session.execute(_largest_earlier(buildings))}
    inspected = {one.building_id: one for one in session.scalars(_inspections(buildings))}
    unseen = {line[0]: (line[1], line[2]) for line in session.execute(_unseen(buildings))}
    compared = set(session.scalars(_being_compared(buildings)))
    summed = _totals(session, buildings)
    return {
        number: StoredFacts(
            file=building_store.parsed(revision),
            results=[line[1] for line in results[number]],
            layer=next((line[1] for line in layers[number]), None),
            shaking=next((line[1] for line in shaken[number]), None),
            totals=summed.get(number),
            largest_earlier=largest.get(number),
            stiffness=[tuple(line[1:]) for line in stiffness[number]],
            is_being_compared=number in compared,
            alerts=[(line[1], line[1].state) for line in alerts[number]],
            inspection=inspected.get(number),
            unseen=unseen.get(number),
        )
        for number, revision in session.execute(_revisions(buildings))
    }


def _grouped(session: Session, question: Question) -> Mapping[int, list[Line]]:
    """Lines by their first column."""
    lines: dict[int, list[Line]] = defaultdict(list)
    for line in session.execute(question):
        lines[line[0]].append(line)
    return lines


def _last_event() -> ScalarSelect[Any]:
    """Number of the last event of a building of the question around it."""
    of_building = aliased(Event)
    latest = select(of_building.id).where(of_building.building_id == Building.id).correlate(Building)
    return latest.order_by(of_building.start.desc(), of_building.id.desc()).limit(1).scalar_subquery()


def _last(buildings: Question) -> Question:
    question = select(Building, Event, Analysis).select_from(Building).outerjoin(Event, Event.id == _last_event())
    with_analysis = question.outerjoin(Analysis, (Analysis.event_id == Event.id) & Analysis.current)
    return with_analysis.where(Building.id.in_(buildings))


def _open(buildings: Question) -> tuple[Any, ...]:
    return (Alert.building_id.in_(buildings), Alert.closed_at.is_(None))


def _revisions(buildings: Question) -> Question:
    other = aliased(Revision)
    newest = select(func.max(other.number)).where(other.building_id == Revision.building_id).scalar_subquery()
    of_buildings = (Revision.building_id.in_(buildings), Revision.number == newest)
    return select(Revision.building_id, Revision).where(*of_buildings)


def _with_building(table: type[DirectionResult | LayerResult | ShakingResult], analyses: Question) -> Question:
    """(number of the building, row) of the results of these analyses."""
    joined = select(Event.building_id, table).join(Analysis, Analysis.id == table.analysis_id)
    return joined.join(Event, Event.id == Analysis.event_id).where(table.analysis_id.in_(analyses))


def _stiffness(buildings: Question) -> Question:
    value = (DriftValue.series_id == MonitoredSeries.id) & (DriftValue.event_id == _last_event())
    question = select(MonitoredSeries.building_id, MonitoredSeries.subject, MonitoredSeries.wanted)
    question = question.add_columns(*history.corrections(), DriftValue)
    question = question.join(Building, Building.id == MonitoredSeries.building_id).outerjoin(DriftValue, value)
    of_stiffness = (MonitoredSeries.building_id.in_(buildings), MonitoredSeries.quantity == "stiffness")
    return question.where(*of_stiffness).order_by(MonitoredSeries.subject)


def _largest_earlier(buildings: Question) -> Question:
    """(number of the building, m) from the usable analyses of the events before the last one."""
    last = aliased(Event)
    moved = func.coalesce(LayerResult.peak_resultant, DirectionResult.peak_displacement)
    return (
        select(Event.building_id, func.max(moved))
        .join(Building, Building.id == Event.building_id)
        .join(last, last.id == _last_event())
        .join(Analysis, (Analysis.event_id == Event.id) & Analysis.current & Analysis.refusal.is_(None))
        .join(DirectionResult, DirectionResult.analysis_id == Analysis.id)
        .outerjoin(LayerResult, LayerResult.analysis_id == Analysis.id)
        .where(Event.building_id.in_(buildings), Event.start < last.start)
        .group_by(Event.building_id)
    )


def _totals(session: Session, buildings: Question) -> Mapping[int, Totals]:
    """Sums over all earthquakes, by number of the building."""
    last = select(_last_event()).select_from(Building).where(Building.id.in_(buildings))
    return {building: sums for _, building, sums in totals(session, buildings, last)}


def _inspections(buildings: Question) -> Question:
    """The latest inspection of each building."""
    other = aliased(BuildingInspection)
    of_building = select(other.id).where(other.building_id == BuildingInspection.building_id)
    latest = of_building.order_by(other.inspected_at.desc(), other.id.desc()).limit(1).scalar_subquery()
    return select(BuildingInspection).where(
        BuildingInspection.building_id.in_(buildings), BuildingInspection.id == latest
    )


def _unseen(buildings: Question) -> Question:
    """(number of the building, count, start of the last) of the events without a usable record before the last event.

    An inspection settles those before it.
    """
    last, of_building = aliased(Event), BuildingInspection.building_id == Event.building_id
    inspected = exists().where(of_building, BuildingInspection.inspected_at >= Event.end)
    return (
        select(Event.building_id, func.count(), func.max(Event.start))
        .join(Building, Building.id == Event.building_id)
        .join(last, last.id == _last_event())
        .where(Event.building_id.in_(buildings), Event.state.in_(UNUSABLE), Event.start < last.start, ~inspected)
        .group_by(Event.building_id)
    )


def _being_compared(buildings: Question) -> Question:
    """Numbers of the buildings whose latest comparison with earlier earthquakes waits or is under way."""
    later = aliased(Job)
    is_latest = ~exists().where(later.kind == WATCH, later.building_id == Job.building_id, later.id > Job.id)
    return select(Job.building_id).where(
        Job.kind == WATCH, Job.building_id.in_(buildings), Job.state.in_(UNDER_WAY), is_latest
    )
