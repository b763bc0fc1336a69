"""The stored facts that an assessment of an earthquake, or of a building, rests on."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy.orm import Session

from core.description import BuildingDescription, IsolationLayer
from service.alerts.tables import Alert
from service.analyses import history, queries as analysis_queries
from service.analyses.tables import Analysis, DirectionResult, LayerResult
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building
from service.db.select import Line
from service.drift.tables import DriftValue
from service.jobs import queue as job_queue
from service.records import queries as record_queries
from service.records.tables import Event
from service.verdict import overview, shaking
from service.verdict.accumulated import Totals, rest_position, totals, travel
from service.verdict.assessment import ACTIVE, Assessment, Facts, OpenAlert, Result, SignedInspection, assess
from service.verdict.checks import COVERAGE, LEVELS, Lacking, Level, Measured
from service.verdict.limits import TOLERANCE
from service.verdict.measured import (
    NO_DISPLACEMENT,
    NO_RESIDUAL,
    NOT_COMPARED,
    Problems,
    measured_displacement,
    measured_residual,
    problems,
)
from service.verdict.overview import StoredFacts
from service.verdict.shaking import ShakingFacts
from service.verdict.texts import NONE_YET

SILENT = ("source", "record")
"""Causes of alerts that say that no records arrive."""
NO_REFERENCE = Lacking(
    reason="The reference period has too few earthquakes to compare this one with.",
    remedy="More earthquakes, until the reference period is complete.",
)
REFERENCE = Lacking(
    reason="This earthquake belongs to the reference period; only later ones are compared with it.",
    remedy="More earthquakes, until the reference period is complete.",
)
NO_CYCLE = Lacking(
    reason="It has no cycle that can be compared with earlier earthquakes.",
    remedy="A stronger earthquake, or a usable record of the isolators' displacement.",
)
BEYOND = Lacking(
    reason="Its amplitudes lie outside those of the reference period.",
    remedy="More earthquakes of such amplitudes, or the engineer's judgement.",
)
EXCLUDED = Lacking(
    reason="A data problem keeps this earthquake out of the comparison.", remedy="Repair the sensor and analyse again."
)
AGE, COMPOUND = "age", "compound"
"""Entries that decide how far the rubber hardens."""
PENDING = Lacking(reason="The earthquake has not been analysed yet.", remedy="The analysis, which is under way.")
NOT_SCREENED = Problems(data_problems=PENDING, sensor_problems=PENDING, clock_problems=PENDING)
COMPARING = Lacking(reason=NOT_COMPARED.reason, remedy="The comparison, which is under way.")
STATES: Mapping[str, str] = {
    "gathering": "its files are still coming in",
    "queued": "its analysis has not finished",
}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Standing:
    """A building now: its verdict, and the facts that pages and messages show beside it."""

    building: Building
    file: BuildingFile
    event: Event | None
    """Its last earthquake; None before the first."""
    verdict: Assessment


def of_event(session: Session, event: Event, at: datetime | None = None) -> Assessment:
    """The assessment of an earthquake.

    Args:
        session: to read with.
        event: which one.
        at: the open alerts are those of this time; None: of now.
    """
    building = session.get_one(Building, event.building_id)
    analysis = record_queries.event_with_analysis(session, event.id).Analysis
    facts = StoredFacts(
        file=building_store.described(session, building),
        results=analysis_queries.direction_results(session, analysis.id) if analysis else (),
        layer=analysis_queries.layer_result(session, analysis.id) if analysis else None,
        shaking=analysis_queries.shaking_result(session, analysis.id) if analysis else None,
        totals=_totals(session, event),
        largest_earlier=history.largest_before(session, event),
        stiffness=[tuple(row) for row in history.stiffness_values(session, event)],
        is_being_compared=job_queue.is_monitoring_pending(session, building.id),
        alerts=history.open_at(session, building.id, at),
    )
    return assess(event_facts(event, analysis, facts))


def of_building(session: Session, building: Building) -> Assessment:
    """The assessment of a building now: of its last earthquake, what is open, and whether records arrive."""
    return of_buildings(session, [building.id])[building.id]


def of_buildings(session: Session, buildings: Collection[int]) -> Mapping[int, Assessment]:
    """The assessments of several buildings now, by number; the statements are as many as for one building.

    Args:
        session: to read with.
        buildings: their numbers, at most a few thousand.
    """
    return {one.building.id: one.verdict for one in standings(session, buildings)}


def standings(session: Session, buildings: Collection[int]) -> Sequence[Standing]:
    """Several buildings now, in no order, by as many statements as one takes; arguments as those of `of_buildings`."""
    rows = overview.last_events(session, buildings)
    stored = overview.stored_facts(session, rows)
    return [
        Standing(
            building=row.Building,
            file=stored[row.Building.id].file,
            event=row.Event,
            verdict=_of_building(row, stored[row.Building.id]),
        )
        for row in rows
    ]


def _of_building(row: Line, facts: StoredFacts) -> Assessment:
    silence = next((one.summary for one, state in facts.alerts if one.cause in SILENT and state in ACTIVE), "")
    if row.Event is not None:
        return assess(event_facts(row.Event, row.Analysis, facts, silence))
    return assess(
        Facts(
            unusable=NONE_YET,
            silence=silence,
            layer=facts.file.description.isolation,
            limits=facts.file.limits,
            displacement=NO_DISPLACEMENT,
            residual=NO_RESIDUAL,
            rest_position=NO_RESIDUAL,
            travel=NO_DISPLACEMENT,
            shaking=shaking.lacking(shaking.NO_SHAKING),
            largest_earlier=None,
            stiffness={},
            **problems(()),
            alerts=tuple(_alert(one, state, None, facts.tolerance) for one, state in facts.alerts),
            inspection=_inspection(facts, None),
        )
    )


def ended_alerts(session: Session, event: Event) -> tuple[OpenAlert, ...]:
    """Alerts that have ended, and whose evidence includes the earthquake, or that were open when it happened."""
    ended = [(one, _alert(one, one.state, event)) for one in history.ended(session, event.building_id)]
    return tuple(
        alert
        for one, alert in ended
        if alert.rests_here
        or (one.began_at <= event.start and one.closed_at is not None and one.closed_at > event.start)
    )


def motion(session: Session, analysis: Analysis | None) -> tuple[Measured | Lacking, Measured | Lacking]:
    """m, largest and residual displacement in plan, by an analysis."""
    results = analysis_queries.direction_results(session, analysis.id) if analysis else ()
    layer = analysis_queries.layer_result(session, analysis.id) if analysis else None
    return _displacement(results, layer), _residual(results)


def shaking_facts(session: Session, analysis: Analysis, description: BuildingDescription) -> ShakingFacts:
    """Measures of the shaking, floors and storeys, by an analysis."""
    return shaking.of_result(analysis_queries.shaking_result(session, analysis.id), description)


def event_facts(event: Event, analysis: Analysis | None, facts: StoredFacts, silence: str = "") -> Facts:
    """Inputs of the assessment of an earthquake; `silence` is the reason why later ones may have been missed."""
    usable = analysis if analysis is not None and analysis.refusal is None else None
    is_pending = usable is None and event.state in STATES
    results, layer = (facts.results, facts.layer) if usable is not None else ((), None)
    return Facts(
        unusable=_unusable(event),
        silence=silence,
        provisional=_provisional(event, facts),
        unseen=_unseen(facts),
        layer=facts.file.description.isolation,
        limits=facts.file.limits,
        displacement=PENDING if is_pending else _displacement(results, layer),
        residual=PENDING if is_pending else _residual(results),
        rest_position=PENDING if is_pending or facts.totals is None else rest_position(facts.totals),
        travel=PENDING if is_pending or facts.totals is None else travel(facts.totals),
        shaking=shaking.lacking(PENDING) if is_pending else _shaking(usable, facts),
        largest_earlier=facts.largest_earlier,
        stiffness=_stiffness(facts, is_pending),
        **(NOT_SCREENED if usable is None else _problems(usable)),
        alerts=tuple(_alert(one, state, event, facts.tolerance) for one, state in facts.alerts),
        inspection=_inspection(facts, event),
    )


def _inspection(facts: StoredFacts, event: Event | None) -> SignedInspection | None:
    row = facts.inspection
    if row is None:
        return None
    return SignedInspection(
        by=row.by,
        at=row.inspected_at,
        result=Result(row.result),
        comment=row.comment,
        level=Level(row.level),
        covers=event is None or row.inspected_at >= event.end,
    )


def _shaking(usable: Analysis | None, facts: StoredFacts) -> ShakingFacts:
    if usable is None:
        return shaking.lacking(shaking.NO_SHAKING)
    return shaking.of_result(facts.shaking, facts.file.description)


def _unusable(event: Event) -> str:
    if event.state not in overview.UNUSABLE:
        return ""
    why = event.reason or "no reason was noted"
    return f"Its records cannot be used: {why}" if event.state == "refused" else f"Its analysis failed: {why}"


def _unseen(facts: StoredFacts) -> str:
    if facts.unseen is None:
        return ""
    count, last = facts.unseen
    if count == 1:
        return f"The earthquake of {last:%Y-%m-%d %H:%M} UTC has no usable record"
    return f"{count} earthquakes, the last of {last:%Y-%m-%d %H:%M} UTC, have no usable record"


def _provisional(event: Event, facts: StoredFacts) -> str:
    if event.state in STATES:
        return STATES[event.state]
    return "the comparison with earlier earthquakes has not finished" if facts.is_being_compared else ""


def _displacement(results: Sequence[DirectionResult], layer: LayerResult | None) -> Measured | Lacking:
    peaks = {
        one.direction: (one.peak_displacement, one.peak_displacement_std)
        for one in results
        if one.peak_displacement is not None
    }
    return measured_displacement(peaks, layer.peak_resultant if layer else None)


def _residual(results: Sequence[DirectionResult]) -> Measured | Lacking:
    return measured_residual(
        {
            one.direction: (one.residual_displacement, one.residual_displacement_std)
            for one in results
            if one.residual_displacement is not None
        }
    )


def _stiffness(facts: StoredFacts, is_pending: bool) -> dict[str, Measured | Lacking]:
    layer = facts.file.description.isolation
    rows = {
        subject: (wanted, value, _corrections(layer, temperature, hardening))
        for subject, wanted, temperature, hardening, value in facts.stiffness
    }
    directions = facts.file.description.horizontal_directions
    if is_pending:
        return dict.fromkeys(directions, PENDING)
    if facts.is_being_compared:
        rows = {subject: row for subject, row in rows.items() if row[1] is not None}
        return {one: _change(*rows[one]) if one in rows else COMPARING for one in directions}
    return {one: _change(*rows[one]) if one in rows else NOT_COMPARED for one in directions}


def _corrections(layer: IsolationLayer, temperature: float | None, hardening: float | None) -> str:
    """Corrections of the expected stiffness besides that for amplitude, and the reason if age is not among them."""
    weather = "season" if temperature is None else "temperature"
    if hardening is not None:
        return f"corrected for {weather} and age"
    unknown = [name for name, one in ((AGE, layer.installed), (COMPOUND, layer.rubber)) if one is None]
    why = f"{' and '.join(unknown)} of the rubber not known" if unknown else "until the next earthquake"
    return f"corrected for {weather}, not for age: {why}"


def _change(wanted: int, value: DriftValue | None, note: str) -> Measured | Lacking:
    """The event's change of stiffness from the value expected at its amplitude, temperature and age."""
    if value is None:
        return NO_REFERENCE if wanted else NO_CYCLE
    for applies, lacking in (
        (value.is_reference, REFERENCE),
        (value.is_excluded, EXCLUDED),
        (value.is_beyond, BEYOND),
    ):
        if applies:
            return lacking
    return Measured(value=value.value, uncertainty=COVERAGE * value.std, note=note)


def _totals(session: Session, event: Event) -> Totals | None:
    own = totals(session, [event.building_id], [event.id])
    return next((sums for _, _, sums in own), None)


def _problems(analysis: Analysis) -> Problems:
    findings = [one for one in analysis.quality if one["severity"] != "note"]
    return problems((one["kind"], " ".join(filter(None, (one.get("channel"), one["message"])))) for one in findings)


def _alert(alert: Alert, state: str, event: Event | None, tolerance: float = TOLERANCE) -> OpenAlert:
    rests = event is not None and event.id in (*alert.event_ids, alert.onset_event_id, alert.raised_event_id)
    low, high = alert.evidence.get("low"), alert.evidence.get("high")
    return OpenAlert(
        id=alert.id,
        cause=alert.cause,
        kind=alert.kind,
        state=state,
        summary=alert.summary,
        low=low,
        high=high,
        tolerance=tolerance,
        exceeded=Level(level) if (level := alert.evidence.get("level")) in LEVELS else None,
        rests_here=rests,
        is_of_another=rests and event is not None and alert.evidence.get("event", event.id) != event.id,
        is_later=event is not None and not rests and (alert.changed_after or alert.began_at) >= event.start,
    )
