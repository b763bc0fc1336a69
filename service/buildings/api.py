"""The API of buildings: descriptions, events, equivalent stiffness and modes over the years."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Response
from sqlalchemy.orm import Session, sessionmaker

from service.access.auth import Caller, engineer
from service.analyses import added_sensors, history, mode_tracks
from service.analyses.mode_tracks import Sighting, TrackedMode
from service.analyses.schema import Events
from service.analyses.series_schema import Cycles, Modes, SightingOut, TrackOut, Tracks
from service.buildings import queries
from service.buildings.schema import AddedSensorsRequest, BuildingOut, Buildings, ChannelOut, ContactOut, LevelOut
from service.buildings.store import described
from service.db.select import Line
from service.http.paging import (
    AfterCode,
    Cursor,
    Limit,
    M,
    RowLimit,
    next_code,
    next_place,
    page_by_event,
    place,
    rows_of,
)
from service.http.parameters import AnyDirection, Code, EventSpan, MinimumPga, Reading, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, responses, table_responses
from service.jobs.schema import JobOut
from service.records import queries as record_queries
from service.verdict import reading
from service.verdict.schema import VerdictOut, verdict_out

LOCATION = {"description": "Address of the job.", "schema": {"type": "string"}}

router = APIRouter(prefix="/buildings", tags=["buildings"], route_class=TaggedRoute)


@router.get("", operation_id="list_buildings", **table_responses(Buildings))
def buildings(sessions: Reading, cursor: AfterCode = None, limit: Limit = 50) -> Buildings:
    """The buildings, by code."""
    with sessions() as session:
        rows = [(b.code, b.name, events, last) for b, _, events, last in queries.buildings(session, cursor, limit)]
    return rows_of(Buildings, rows, next_code([row[0] for row in rows], limit))


@router.get("/{code}", operation_id="get_building", **responses(BuildingOut, 404))
def building(code: Code, sessions: Reading) -> BuildingOut:
    """A building's current description: levels, sensors, isolation layer."""
    with sessions() as session:
        building, revision = queries.building(session, code)
        file = described(session, building)
        verdict = verdict_out(reading.of_building(session, building))
    description = file.description
    return BuildingOut(
        code=building.code,
        name=building.name,
        revision=revision.number,
        revised_at=revision.created_at,
        rubber_height=description.isolation.rubber_height,
        design_displacement=description.isolation.design_displacement,
        moat_clearance=description.isolation.moat_clearance,
        verdict=verdict,
        latitude=file.latitude,
        longitude=file.longitude,
        timezone=file.timezone,
        levels=[LevelOut.model_validate(level) for level in description.levels],
        channels=[ChannelOut.model_validate(channel) for channel in description.channels],
        contacts=[ContactOut.model_validate(contact) for contact in file.contacts],
    )


@router.get("/{code}/verdict", operation_id="get_building_verdict", **responses(VerdictOut, 404))
def verdict(code: Code, sessions: Reading) -> VerdictOut:
    """The verdict on a building now: by its last earthquake, the open alerts, and whether records arrive."""
    with sessions() as session:
        building, _ = queries.building(session, code)
        return verdict_out(reading.of_building(session, building))


@router.get("/{code}/events", operation_id="list_events", **table_responses(Events, 404))
def events(
    code: Code,
    sessions: Reading,
    span: EventSpan,
    min_pga: MinimumPga = None,
    cursor: Cursor = None,
    limit: Limit = 50,
) -> Events:
    """The building's events, the latest first."""
    with sessions() as session:
        building, _ = queries.building(session, code)
        pairs = record_queries.events(session, building.id, span, min_pga, place(cursor), limit)
    rows = [
        (e.id, e.start, e.end, e.state, e.reason, a and a.pga, a and a.id)
        for e, a in pairs
    ]  # fmt: skip
    last = next_place([(e.start, e.id) for e, _ in pairs], limit)
    return rows_of(Events, rows, last)


@dataclass(frozen=True, slots=True)
class HistoryPage:
    """Parameters of a history: which rows, and which page of them."""

    span: EventSpan
    direction: AnyDirection = None
    cursor: Cursor = None
    limit: RowLimit = 5000


Wanted = Annotated[HistoryPage, Depends()]


@router.get("/{code}/equivalent", operation_id="list_equivalent", **table_responses(Cycles, 404))
def equivalent(code: Code, sessions: Reading, wanted: Wanted) -> Cycles:
    """Equivalent stiffness and damping of the isolation layer, a row per cycle of each event, the earliest first."""
    return _history(Cycles, history.cycles, code, sessions, wanted)


@router.get("/{code}/modes", operation_id="list_modes", **table_responses(Modes, 404))
def modes(code: Code, sessions: Reading, wanted: Wanted) -> Modes:
    """Frequencies and damping ratios of the superstructure, a row per mode of each event, the earliest first."""
    return _history(Modes, history.modes, code, sessions, wanted)


def _history(
    model: type[M], read: Callable[..., Sequence[Line]], code: str, sessions: sessionmaker[Session], wanted: HistoryPage
) -> M:
    """A page of what `read` finds about a building."""
    with sessions() as session:
        building, _ = queries.building(session, code)
        rows = read(session, building.id, wanted.span, wanted.direction, place(wanted.cursor), wanted.limit)
    return page_by_event(model, rows, wanted.limit, building=code)


@router.get("/{code}/mode-tracks", operation_id="list_mode_tracks", **responses(Tracks, 404))
def tracks(code: Code, sessions: Reading, span: EventSpan, direction: AnyDirection = None) -> Tracks:
    """The modes of the superstructure, each followed over the latest events by its frequency and shape."""
    with sessions() as session:
        building, _ = queries.building(session, code)
        directions = mode_tracks.DIRECTIONS if direction is None else (direction,)
        modes = [mode for one in directions for mode in mode_tracks.tracked_modes(session, building.id, span, one)]
    return Tracks(building=code, items=[_track(mode) for mode in modes])


def _track(mode: TrackedMode) -> TrackOut:
    return TrackOut(
        direction=mode.direction,
        number=mode.number,
        established=mode.is_established,
        frequency=mode.frequency,
        damping_ratio=mode.damping_ratio,
        events=[_sighting(sighting) for sighting in mode.sightings],
    )


def _sighting(sighting: Sighting) -> SightingOut:
    mode = sighting.mode
    return SightingOut(
        event=sighting.event,
        event_start=sighting.event_start,
        pga=sighting.pga,
        peak_force=sighting.peak_force,
        peak_displacement=sighting.peak_displacement,
        frequency=mode.frequency,
        frequency_std=mode.frequency_std,
        damping_ratio=mode.damping_ratio,
        damping_ratio_std=mode.damping_ratio_std,
        shape=dict(zip(sighting.levels, mode.shape.tolist(), strict=True)),
        shape_std=None if mode.shape_std is None else dict(zip(sighting.levels, mode.shape_std.tolist(), strict=True)),
        misfit=mode.misfit,
    )


@router.post(
    "/{code}/added-sensors",
    operation_id="compare_added_sensors",
    status_code=202,
    response_model=JobOut,
    responses=openapi_responses(400, 401, 403, 404, 409, 422, 429) | {202: {"headers": {"Location": LOCATION}}},
)
def compare_added_sensors(
    code: Code,
    sessions: Writing,
    response: Response,
    by: Annotated[Caller, Depends(engineer)],
    wanted: Annotated[AddedSensorsRequest, Body(description="Events; {} for the ten strongest.")],
) -> JobOut:
    """Compute by how much one more accelerometer at each level would narrow the force and the modes.

    From the building's own records. The job's `result` has the `sensors`: standard deviations of the force and of the
    modes today, and with one more accelerometer at each level that has none, that which narrows the force most first.
    """
    with sessions.begin() as session:
        job = added_sensors.request(session, code, wanted.events, by.name, datetime.now(UTC))
        answer = JobOut.model_validate(job)
    response.headers["Location"] = f"/api/v1/jobs/{answer.id}"
    return answer
