"""The API of buildings: descriptions, events, equivalent stiffness and modes over the years."""

from datetime import datetime

from fastapi import APIRouter, Request, Response

from service.analyses import history, mode_tracks
from service.analyses.mode_tracks import Sighting, TrackedMode
from service.analyses.schema import EventRow, Events
from service.analyses.series_schema import CycleRow, Cycles, ModeRow, Modes, SightingOut, TrackOut, Tracks
from service.buildings import queries
from service.buildings.schema import BuildingOut, BuildingRow, Buildings, ChannelOut, LevelOut
from service.buildings.store import described
from service.db.select import Place
from service.http.parameters import (
    AnyDirection,
    Code,
    Cursor,
    EventSpan,
    Limit,
    MinimumPga,
    Reading,
    RowLimit,
    place,
)
from service.http.responses import Format, document, responses, table
from service.records import queries as record_queries
from service.verdict import reading
from service.verdict.documents import assessment_json
from service.verdict.schema import VerdictOut

router = APIRouter(prefix="/buildings", tags=["buildings"])


def following(rows: list[tuple[datetime, int]], limit: int) -> str | None:
    """The cursor of the next page; None where this one was not full."""
    return str(Place(*rows[-1])) if len(rows) == limit else None


@router.get("", operation_id="list_buildings", **responses(Buildings, csv=True))
def buildings(request: Request, sessions: Reading, format: Format = None) -> Response:
    """Every building, by code."""
    with sessions() as session:
        rows = [(b.code, b.name, events, last) for b, _, events, last in queries.buildings(session)]
    return table(request, format, tuple(BuildingRow.model_fields), rows, None)


@router.get("/{code}", operation_id="get_building", **responses(BuildingOut, 404))
def building(request: Request, code: Code, sessions: Reading) -> Response:
    """A building's current description: levels, sensors, isolation layer."""
    with sessions() as session:
        found, revision = queries.building(session, code)
        file = described(session, found)
        verdict = VerdictOut(**assessment_json(reading.of_building(session, found)))
    description = file.description
    answer = BuildingOut(
        code=found.code,
        name=found.name,
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
    )
    return document(request, answer)


@router.get("/{code}/events", operation_id="list_events", **responses(Events, 404, csv=True))
def events(
    request: Request,
    code: Code,
    sessions: Reading,
    span: EventSpan,
    min_pga: MinimumPga = None,
    cursor: Cursor = None,
    limit: Limit = 50,
    format: Format = None,
) -> Response:
    """The building's events, the latest first."""
    with sessions() as session:
        found, _ = queries.building(session, code)
        pairs = record_queries.events(session, found.id, span, min_pga, place(cursor), limit)
    rows = [
        (e.id, e.start, e.end, e.state, e.reason, a and a.pga, a and a.id)
        for e, a in pairs
    ]  # fmt: skip
    last = following([(e.start, e.id) for e, _ in pairs], limit)
    return table(request, format, tuple(EventRow.model_fields), rows, last)


@router.get("/{code}/equivalent", operation_id="list_equivalent", **responses(Cycles, 404, csv=True))
def equivalent(
    request: Request,
    code: Code,
    sessions: Reading,
    span: EventSpan,
    direction: AnyDirection = None,
    cursor: Cursor = None,
    limit: RowLimit = 5000,
    format: Format = None,
) -> Response:
    """Equivalent stiffness and damping of the isolation layer, a row per cycle of each event, the earliest first."""
    with sessions() as session:
        found, _ = queries.building(session, code)
        rows = history.cycles(session, found.id, span, direction, place(cursor), limit)
    last = following([(row.event_start, row.id) for row in rows], limit)
    columns = tuple(CycleRow.model_fields)
    return table(request, format, columns, [row[:-1] for row in rows], last, building=code)


@router.get("/{code}/modes", operation_id="list_modes", **responses(Modes, 404, csv=True))
def modes(
    request: Request,
    code: Code,
    sessions: Reading,
    span: EventSpan,
    direction: AnyDirection = None,
    cursor: Cursor = None,
    limit: RowLimit = 5000,
    format: Format = None,
) -> Response:
    """Frequencies and damping ratios of the superstructure, a row per mode of each event, the earliest first."""
    with sessions() as session:
        found, _ = queries.building(session, code)
        rows = history.modes(session, found.id, span, direction, place(cursor), limit)
    last = following([(row.event_start, row.id) for row in rows], limit)
    columns = tuple(ModeRow.model_fields)
    return table(request, format, columns, [row[:-1] for row in rows], last, building=code)


@router.get("/{code}/mode-tracks", operation_id="list_mode_tracks", **responses(Tracks, 404))
def tracks(
    request: Request, code: Code, sessions: Reading, span: EventSpan, direction: AnyDirection = None
) -> Response:
    """The modes of the superstructure, each followed over the latest events by its frequency and shape."""
    with sessions() as session:
        found, _ = queries.building(session, code)
        asked = mode_tracks.DIRECTIONS if direction is None else (direction,)
        modes = [mode for one in asked for mode in mode_tracks.tracked_modes(session, found.id, span, one)]
    return document(request, Tracks(building=code, items=[_track(mode) for mode in modes]))


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
