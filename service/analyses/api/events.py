"""One event with its results, and requests to analyse it again."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Request, Response
from sqlalchemy.orm import Session

from core.description import BuildingDescription
from service.access.auth import Caller, engineer
from service.analyses import document, queries
from service.analyses.schema import AnalysisRequest, EventOut, Provenance, WaveformOut
from service.analyses.tables import Analysis
from service.buildings.description import LevelError, named_levels
from service.buildings.store import described
from service.errors import ConflictError, NotFoundError
from service.http.parameters import AnalysisId, Id, Reading, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, responses
from service.jobs import queue as job_queue
from service.jobs.schema import JobOut
from service.records import queries as record_queries
from service.settings import Settings
from service.verdict import reading
from service.verdict.schema import VerdictOut, verdict_out

router = APIRouter(prefix="/events", tags=["events"], route_class=TaggedRoute)

NO_RESULTS: Mapping[str, Any] = {
    **{name: [] for name in ("quality", "peaks", "sensors", "directions")},
    "layer": None,
    "shaking": None,
}
LOCATION = {"description": "Address of the job.", "schema": {"type": "string"}}


@router.get("/{event_id}", operation_id="get_event", **responses(EventOut, 404))
def event(event_id: Id, sessions: Reading, analysis: AnalysisId = None) -> EventOut:
    """An event: channels, quality, peaks, modes, and what the analysis was made from."""
    with sessions() as session:
        stored = record_queries.event(session, event_id)
        made = record_queries.analyses(session, event_id)
        shown = chosen(made, analysis)
        return EventOut(
            id=stored.id,
            building=stored.building.code,
            start=stored.start,
            end=stored.end,
            state=stored.state,
            reason=stored.reason,
            pga=shown.pga if shown else None,
            temperature=shown.temperature if shown else None,
            waveforms=[WaveformOut.model_validate(waveform) for waveform in stored.waveforms],
            analysis=Provenance.model_validate(shown) if shown else None,
            earlier=[Provenance.model_validate(one) for one in made if one is not shown],
            verdict=verdict_out(reading.of_event(session, stored)),
            **(_results(session, shown, described(session, stored.building).description) if shown else NO_RESULTS),
        )


@router.get("/{event_id}/verdict", operation_id="get_event_verdict", **responses(VerdictOut, 404))
def verdict(event_id: Id, sessions: Reading) -> VerdictOut:
    """The verdict on a building after an earthquake, by its latest analysis and the alerts that are open now."""
    with sessions() as session:
        return verdict_out(reading.of_event(session, record_queries.event(session, event_id)))


def chosen(made: Sequence[Analysis], number: int | None) -> Analysis | None:
    """The analysis of that number, or the latest; None before the first."""
    if number is None:
        return next((analysis for analysis in made if analysis.current), None)
    selected = next((analysis for analysis in made if analysis.id == number), None)
    if selected is None:
        raise NotFoundError("analysis of this event", number)
    return selected


def _results(session: Session, analysis: Analysis, description: BuildingDescription) -> dict[str, Any]:
    """Fields of a stored analysis, without its histories."""
    cycles = queries.cycle_counts(session, analysis.id)
    stored = queries.direction_results(session, analysis.id)
    return document.results(analysis, description) | {
        "directions": [document.direction_out(one, cycles.get(one.id, 0)) for one in stored],
        "layer": document.layer_out(queries.layer_result(session, analysis.id)),
        "shaking": document.shaking_out(queries.shaking_result(session, analysis.id)),
    }


@router.post(
    "/{event_id}/analyses",
    operation_id="analyse_event",
    status_code=202,
    response_model=JobOut,
    responses=openapi_responses(400, 401, 403, 404, 409, 422, 429) | {202: {"headers": {"Location": LOCATION}}},
)
def analyse(
    request: Request,
    event_id: Id,
    sessions: Writing,
    response: Response,
    by: Annotated[Caller, Depends(engineer)],
    wanted: Annotated[AnalysisRequest, Body(description="Settings that differ; {} for none.")],
) -> JobOut:
    """Analyse the event again; the earlier results are kept. An equal job that still waits is returned instead.

    The requested settings must fit the building and the current settings; otherwise 409 gives the remedy.
    """
    with sessions.begin() as session:
        stored = record_queries.event(session, event_id)
        arguments = checked(wanted, described(session, stored.building).description, request.app.state.settings)
        job = job_queue.enqueue(session, stored, arguments, datetime.now(UTC), by.name)
        answer = JobOut.model_validate(job)
    response.headers["Location"] = f"/api/v1/jobs/{answer.id}"
    return answer


def checked(wanted: AnalysisRequest, description: BuildingDescription, own: Settings) -> dict[str, object]:
    """The arguments of the job.

    Raises:
        ConflictError: the building has no such level, or the band does not fit the rate.
    """
    arguments = wanted.model_dump(exclude_none=True)
    if wanted.sensors is not None:
        try:
            arguments["sensors"] = named_levels(wanted.sensors, description)
        except LevelError as error:
            raise ConflictError(f"The sensors do not fit the building {description.code}: {error}.") from None
    low, high = wanted.band or own.analysis.band
    rate = wanted.rate or own.analysis.rate
    if not low < high < rate / 2:
        raise ConflictError(
            f"The band {low:g} to {high:g} Hz does not fit {rate:g} Hz; its upper limit must lie below {rate / 2:g} Hz."
        )
    return {name: list(value) if isinstance(value, tuple) else value for name, value in arguments.items()}
