"""One event with its results, and requests to analyse it again."""

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Request, Response
from sqlalchemy.orm import Session

from core.description import BuildingDescription
from service.access.auth import Caller, engineer
from service.analyses import queries
from service.analyses.schema import (
    AnalysisRequest,
    DirectionOut,
    EventOut,
    FindingOut,
    LayerOut,
    ModeOut,
    PeakOut,
    Provenance,
    RelianceOut,
    SensorOut,
    WaveformOut,
)
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
from service.verdict.schema import verdict_out

router = APIRouter(prefix="/events", tags=["events"], route_class=TaggedRoute)

LOCATION = {"description": "Address of the job.", "schema": {"type": "string"}}


@router.get("/{event_id}", operation_id="get_event", **responses(EventOut, 404))
def event(event_id: Id, sessions: Reading, analysis: AnalysisId = None) -> EventOut:
    """An event: channels, quality, peaks, modes, and what the analysis was made from."""
    with sessions() as session:
        found = record_queries.event(session, event_id)
        made = record_queries.analyses(session, event_id)
        shown = chosen(made, analysis)
        return EventOut(
            id=found.id,
            building=found.building.code,
            start=found.start,
            end=found.end,
            state=found.state,
            reason=found.reason,
            pga=shown.pga if shown else None,
            temperature=shown.temperature if shown else None,
            waveforms=[WaveformOut.model_validate(waveform) for waveform in found.waveforms],
            analysis=Provenance.model_validate(shown) if shown else None,
            earlier=[Provenance.model_validate(one) for one in made if one is not shown],
            verdict=verdict_out(reading.of_event(session, found)),
            quality=[FindingOut.model_validate(finding) for finding in shown.quality] if shown else [],
            peaks=peaks(shown, described(session, found.building).description) if shown else [],
            sensors=[SensorOut.model_validate(sensor) for sensor in shown.sensors] if shown else [],
            directions=directions(session, shown.id) if shown else [],
            layer=layer(session, shown.id) if shown else None,
        )


def chosen(made: Sequence[Analysis], number: int | None) -> Analysis | None:
    """The analysis of that number, or the latest; None before the first."""
    if number is None:
        return next((analysis for analysis in made if analysis.current), None)
    found = next((analysis for analysis in made if analysis.id == number), None)
    if found is None:
        raise NotFoundError("analysis of this event", number)
    return found


def peaks(analysis: Analysis, description: BuildingDescription) -> list[PeakOut]:
    """Peaks by channel, with what each channel measures."""
    known = {channel.id: channel for channel in description.channels}
    return [
        PeakOut(
            channel=channel,
            level=known[channel].level if channel in known else None,
            quantity=known[channel].quantity if channel in known else None,
            direction=known[channel].direction if channel in known else None,
            peak=peak,
        )
        for channel, peak in sorted(analysis.peaks.items())
    ]


def directions(session: Session, analysis_id: int) -> list[DirectionOut]:
    """Results of an analysis by direction."""
    cycles = queries.cycle_counts(session, analysis_id)
    return [
        DirectionOut(
            direction=result.direction,
            peak_force=result.peak_force,
            force_std=result.force_std,
            reliance=None if result.reliance is None else RelianceOut(**result.reliance),
            peak_displacement=result.peak_displacement,
            peak_displacement_std=result.peak_displacement_std,
            lowest_frequency=result.lowest_frequency,
            highest_frequency=result.highest_frequency,
            residual_displacement=result.residual_displacement,
            residual_displacement_std=result.residual_displacement_std,
            cycles=cycles.get(result.id, 0),
            modes=[ModeOut.model_validate(mode) for mode in result.modes],
        )
        for result in queries.direction_results(session, analysis_id)
    ]


def layer(session: Session, analysis_id: int) -> LayerOut | None:
    """Results of an analysis across its directions."""
    found = queries.layer_result(session, analysis_id)
    if found is None:
        return None
    return LayerOut(**{name: getattr(found, name) for name in LayerOut.model_fields})


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
        found = record_queries.event(session, event_id)
        arguments = checked(wanted, described(session, found.building).description, request.app.state.settings)
        job = job_queue.enqueue(session, found, arguments, datetime.now(UTC), by.name)
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
