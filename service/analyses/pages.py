"""Pages of a building's earthquakes: the list, and the results of one."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy.orm import Session

from service.access.pages import reader
from service.analyses import document, queries
from service.analyses.schema import ShakingOut
from service.analyses.tables import Analysis, DirectionResult, LayerResult
from service.buildings import queries as building_queries
from service.db.select import Span
from service.http.paging import Cursor, next_place, place
from service.http.parameters import Code, Id, Reading
from service.http.rendering import page
from service.records import queries as record_queries
from service.records.tables import Event
from service.verdict import reading

STATES = {
    "gathering": "Its files are still coming in",
    "queued": "It waits for its analysis",
    "analysed": "",
    "refused": "It could not be used",
    "failed": "Its analysis failed",
}
"""Description of an event's state; the reason follows."""
MODES = 3
"""Modes that a page lists."""
LISTED = 100
"""Earthquakes of one page."""

router = APIRouter(include_in_schema=False, dependencies=[Depends(reader)])


@dataclass(frozen=True, slots=True)
class View:
    """An event as a page shows it."""

    event: Event
    state: str
    """In words; empty where there are results."""
    analysis: Analysis | None
    results: Sequence[DirectionResult]
    layer: LayerResult | None
    """Results across the directions."""
    shaking: ShakingOut | None
    """None by an analysis of an earlier version."""


@dataclass(frozen=True, slots=True)
class EventLine:
    """An event as a line of the list of all."""

    event: Event
    state: str
    """As in View."""
    pga: float | None
    """m/s²."""
    displacements: Mapping[str, float | None]
    """m, largest of the isolation layer, by direction."""
    forces: Mapping[str, float | None]
    """N."""


@router.get("/events/{event_id}")
def of_event(request: Request, event_id: Id, sessions: Reading) -> Response:
    """One earthquake and its results, with links to the ones before and after it."""
    with sessions() as session:
        event, analysis = record_queries.event_with_analysis(session, event_id)
        before, after = record_queries.neighbours(session, event)
        return page(
            request,
            "event",
            view=viewed(session, event, analysis),
            verdict_on=reading.of_event(session, event),
            ended=reading.ended_alerts(session, event),
            modes=MODES,
            before=before,
            after=after,
        )


@router.get("/buildings/{code}/events")
def of_building(request: Request, code: Code, sessions: Reading, cursor: Cursor = None) -> Response:
    """The building's earthquakes, the latest first."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        pairs = record_queries.events(session, building.id, Span(), None, place(cursor), LISTED)
        peaks = queries.peaks(session, [analysis.id for _, analysis in pairs if analysis])
        directions = sorted({direction for _, direction in peaks})
        return page(
            request,
            "events",
            building=building,
            rows=[_line(event, analysis, peaks, directions) for event, analysis in pairs],
            directions=directions,
            is_later=cursor is not None,
            following=next_place([(event.start, event.id) for event, _ in pairs], LISTED),
        )


def viewed(session: Session, event: Event, analysis: Analysis | None) -> View:
    """An event with the results of its latest analysis."""
    results = queries.direction_results(session, analysis.id) if analysis else []
    layer = queries.layer_result(session, analysis.id) if analysis else None
    shaking = document.shaking_out(queries.shaking_result(session, analysis.id)) if analysis else None
    return View(event, STATES.get(event.state, event.state), analysis, results, layer, shaking)


def _line(
    event: Event,
    analysis: Analysis | None,
    peaks: Mapping[tuple[int, str], tuple[float | None, float]],
    directions: Sequence[str],
) -> EventLine:
    own = {direction: peaks.get((analysis.id if analysis else 0, direction), (None, None)) for direction in directions}
    return EventLine(
        event,
        STATES.get(event.state, event.state),
        analysis.pga if analysis else None,
        {direction: displacement for direction, (displacement, _) in own.items()},
        {direction: force for direction, (_, force) in own.items()},
    )
