"""The stored facts that an assessment of an earthquake, or of a building, rests on."""

from collections.abc import Mapping, Sequence
from datetime import datetime

from sqlalchemy.orm import Session

from core.description import BuildingDescription
from service.alerts.tables import Alert
from service.analyses import history, queries as analysis_queries
from service.analyses.tables import Analysis, DirectionResult, LayerResult
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.db.select import Span
from service.drift.tables import DriftValue
from service.jobs import queue as job_queue
from service.records import queries as record_queries
from service.records.tables import Event
from service.verdict.assessment import ACTIVE, Assessment, Facts, OpenAlert, assess
from service.verdict.checks import LEVELS, Lacking, Level, Measured
from service.verdict.measured import (
    COVERAGE,
    NO_DISPLACEMENT,
    NO_RESIDUAL,
    NOT_COMPARED,
    measured_displacement,
    measured_residual,
)
from service.verdict.texts import NONE_YET

SILENT = ("source", "record")
"""Causes of alerts that say that no records arrive."""
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
    reason="A data problem keeps this earthquake out of the comparison.", remedy="Mend the sensor and analyse again."
)
PENDING = Lacking(reason="The earthquake has not been analysed yet.", remedy="The analysis, which is under way.")
COMPARING = Lacking(reason=NOT_COMPARED.reason, remedy="The comparison, which is under way.")
STATES: Mapping[str, str] = {
    "gathering": "its files are still coming in",
    "queued": "its analysis has not finished",
}


def of_event(session: Session, event: Event, at: datetime | None = None) -> Assessment:
    """The assessment of an earthquake.

    Args:
        session: to read with.
        event: which one.
        at: the open alerts are those of this time; None: of now.
    """
    return assess(_event_facts(session, event, at))


def of_building(session: Session, building: Building) -> Assessment:
    """The assessment of a building now: of its last earthquake, what is open, and whether records arrive."""
    last = record_queries.events(session, building.id, Span(), None, None, limit=1)
    found = history.open_at(session, building.id, None)
    silence = next((one.summary for one, state in found if one.cause in SILENT and state in ACTIVE), "")
    if last:
        return assess(_event_facts(session, last[0].Event, None, silence))
    return assess(
        Facts(
            unusable=NONE_YET,
            silence=silence,
            layer=building_store.described(session, building).description.isolation,
            displacement=NO_DISPLACEMENT,
            residual=NO_RESIDUAL,
            largest_earlier=None,
            stiffness={},
            data_problems=(),
            alerts=tuple(_alert(one, state, None) for one, state in found),
        )
    )


def ended_alerts(session: Session, event: Event) -> tuple[OpenAlert, ...]:
    """Alerts that have ended, and whose evidence includes the earthquake, or that were open when it happened."""
    found = [(one, _alert(one, one.state, event)) for one in history.ended(session, event.building_id)]
    return tuple(
        alert
        for one, alert in found
        if alert.rests_here
        or (one.began_at <= event.start and one.closed_at is not None and one.closed_at > event.start)
    )


def motion(session: Session, analysis: Analysis | None) -> tuple[Measured | Lacking, Measured | Lacking]:
    """m, largest and residual displacement in plan that an analysis found."""
    results = analysis_queries.direction_results(session, analysis.id) if analysis else ()
    layer = analysis_queries.layer_result(session, analysis.id) if analysis else None
    return _displacement(results, layer), _residual(results)


def _event_facts(session: Session, event: Event, at: datetime | None, silence: str = "") -> Facts:
    building = session.get_one(Building, event.building_id)
    file = building_store.described(session, building)
    analysis = record_queries.event_with_analysis(session, event.id).Analysis
    if analysis is not None and analysis.refusal is not None:
        analysis = None
    is_pending = analysis is None and event.state in STATES
    displacement, residual = (PENDING, PENDING) if is_pending else motion(session, analysis)
    return Facts(
        unusable=_unusable(event),
        silence=silence,
        provisional=_provisional(session, event),
        layer=file.description.isolation,
        displacement=displacement,
        residual=residual,
        largest_earlier=history.largest_before(session, event),
        stiffness=dict.fromkeys(file.description.horizontal_directions, PENDING)
        if is_pending
        else _stiffness(session, event, file.description),
        data_problems=_problems(analysis) if analysis else PENDING,
        alerts=tuple(_alert(one, state, event) for one, state in history.open_at(session, building.id, at)),
    )


def _unusable(event: Event) -> str:
    if event.state not in ("refused", "failed"):
        return ""
    why = event.reason or "no reason was noted"
    return f"Its records cannot be used: {why}" if event.state == "refused" else f"Its analysis failed: {why}"


def _provisional(session: Session, event: Event) -> str:
    if event.state in STATES:
        return STATES[event.state]
    if job_queue.is_monitoring_pending(session, event.building_id):
        return "the comparison with earlier earthquakes has not finished"
    return ""


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


def _stiffness(session: Session, event: Event, description: BuildingDescription) -> dict[str, Measured | Lacking]:
    rows = {subject: (wanted, value) for subject, wanted, value in history.stiffness_values(session, event)}
    directions = description.horizontal_directions
    if job_queue.is_monitoring_pending(session, event.building_id):
        rows = {one: (wanted, value) for one, (wanted, value) in rows.items() if value is not None}
        return {one: _change(*rows[one]) if one in rows else COMPARING for one in directions}
    return {one: _change(*rows[one]) if one in rows else NOT_COMPARED for one in directions}


def _change(wanted: int, value: DriftValue | None) -> Measured | Lacking:
    """The event's change of stiffness from what its amplitude and temperature let expect."""
    if value is None:
        return REFERENCE if wanted else NO_CYCLE
    for applies, lacking in (
        (value.is_reference, REFERENCE),
        (value.is_excluded, EXCLUDED),
        (value.is_beyond, BEYOND),
    ):
        if applies:
            return lacking
    return Measured(value=value.value, uncertainty=COVERAGE * value.std)


def _problems(analysis: Analysis) -> tuple[str, ...]:
    found = [one for one in analysis.quality if one["severity"] != "note"]
    return tuple(" ".join(filter(None, (one.get("channel"), one["message"]))) for one in found)


def _alert(found: Alert, state: str, event: Event | None) -> OpenAlert:
    rests = event is not None and event.id in (*found.event_ids, found.onset_event_id, found.raised_event_id)
    low, high = found.evidence.get("low"), found.evidence.get("high")
    return OpenAlert(
        id=found.id,
        cause=found.cause,
        kind=found.kind,
        state=state,
        summary=found.summary,
        low=low,
        high=high,
        exceeded=Level(level) if (level := found.evidence.get("level")) in LEVELS else None,
        rests_here=rests,
        is_later=event is not None and not rests and (found.changed_after or found.began_at) >= event.start,
    )
