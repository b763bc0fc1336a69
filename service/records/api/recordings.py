"""Monitoring servers and the files received from them, in the API and on a page, with the reasons of rejections."""

from datetime import UTC, datetime, timedelta
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from pydantic import Field

from service.access.pages import reader
from service.addresses import without_credentials
from service.alerts.api import AnyBuilding
from service.buildings import queries as building_queries
from service.buildings.description import BuildingFile
from service.buildings.schema import Sources
from service.buildings.store import described, parsed
from service.http.paging import AfterCode, Before, Limit, next_code, next_number, page_by_number, rows_of
from service.http.parameters import Code, Reading
from service.http.rendering import page
from service.http.responses import TaggedRoute, table_responses
from service.records import queries
from service.records.streams import earthquakes, flow
from service.records.tables import Recording, SourceState, StreamState
from service.schema import Answer, Page

router = APIRouter(tags=["operations"], route_class=TaggedRoute)
pages = APIRouter(include_in_schema=False, dependencies=[Depends(reader)])

LISTED = 100
"""Files of one page."""
AnyFileState = Annotated[Literal["waiting", "read", "rejected"] | None, Query(description="Only files in this state.")]


class RecordingOut(Answer):
    """A file, or an answer of a monitoring server, as it came."""

    id: int = Field(description="Number of the recording.", examples=[1])
    building: str = Field(description="Code of the building.")
    name: str = Field(description="Name of the file.", examples=["2024-01-01.mseed"])
    origin: str = Field(description="Its origin: a path, or an address without user name, password and query.")
    received_at: datetime = Field(description="Time of its arrival.")
    size: int | None = Field(description="Bytes; null where they were not fetched, because there were too many.")
    kind: str = Field(description="`waveforms`, `station` or `unknown`.")
    state: str = Field(description="`waiting` (to be read), `read` or `rejected`.", examples=["rejected"])
    reason: str | None = Field(
        description="Why it was rejected, or what of a file that was read could not be used; null where nothing was."
    )
    start: datetime | None = Field(description="First sample, even if of the future; null where none could be used.")
    end: datetime | None = Field(description="Last sample, even if of the future; null where none could be used.")
    deleted_at: datetime | None = Field(description="When its bytes were deleted; null while they are kept.")
    deleted_by: str | None = Field(
        description="Setting that allowed it; null while they are kept.", examples=["retention.original_files"]
    )


class Recordings(Page[RecordingOut]):
    """A page of recordings, the latest first."""


@router.get("/sources", operation_id="list_sources", **table_responses(Sources))
def sources(sessions: Reading, cursor: AfterCode = None, limit: Limit = 50) -> Sources:
    """The buildings' monitoring servers and their state, by code; a page has as many buildings as `limit`."""
    with sessions() as session:
        every = building_queries.sources(session, cursor, limit)
        rows = [
            (
                building.code,
                source.kind,
                without_credentials(source.location),
                *(getattr(state, name, None) for name in ("attempted_at", "succeeded_at", "failing_since", "error")),
            )
            for building, revision, state in every
            if (source := parsed(revision).source) is not None
        ]
    return rows_of(Sources, rows, next_code([building.code for building, _, _ in every], limit))


@router.get("/recordings", operation_id="list_recordings", **table_responses(Recordings, 404))
def every(
    sessions: Reading,
    building: AnyBuilding = None,
    state: AnyFileState = None,
    cursor: Before = None,
    limit: Limit = 50,
) -> Recordings:
    """Files as they came, the latest first, with the reason why one could not be used."""
    with sessions() as session:
        of = None if building is None else building_queries.building(session, building)[0].id
        rows = [row(one) for one in queries.recordings(session, of, state, cursor, limit)]
    return page_by_number(Recordings, rows, limit)


@pages.get("/buildings/{code}/recordings")
def of_building(
    request: Request, code: Code, sessions: Reading, state: AnyFileState = None, cursor: Before = None
) -> Response:
    """The state of the building's monitoring server, and the files received from it."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = [row(one) for one in queries.recordings(session, building.id, state, cursor, LISTED)]
        file = described(session, building)
        source = file.source
        is_live = source is not None and source.kind == "seedlink"
        stream = session.get(StreamState, building.id) if is_live else None
        return page(
            request,
            "recordings",
            zone=file.timezone,
            building=building,
            source=source,
            location=without_credentials(source.location) if source else "",
            doing=session.get(SourceState, building.id),
            **_live(stream, file, datetime.now(UTC), timedelta(seconds=request.app.state.settings.stream.silence)),
            rows=rows,
            state=state,
            rejected=queries.rejected_counts(session, [building.id]).get(building.id, 0),
            is_later=cursor is not None,
            following=next_number([one.id for one in rows], LISTED),
        )


def _live(stream: StreamState | None, file: BuildingFile, now: datetime, silence: timedelta) -> dict[str, Any]:
    """State of a live stream, as the page shows it."""
    if stream is None:
        return {"stream": None}
    flows = flow.of_stream(stream, file)
    return {
        "stream": stream,
        "flows": flows,
        "latencies": {channel: one.latency(now) for channel, one in flows.items()},
        "silent": {channel: one for channel, one in flows.items() if one.is_silent(now, silence)},
        "shaking": earthquakes.read_shaking(stream.shaking),
    }


def row(recording: Recording) -> RecordingOut:
    """A recording as it is shown."""
    return RecordingOut(
        id=recording.id,
        building=recording.building.code,
        name=recording.name,
        origin=without_credentials(recording.origin),
        received_at=recording.received_at,
        size=None if recording.content is None else recording.content.size,
        kind=recording.kind,
        state=queries.STATES[recording.state],
        reason=recording.reason,
        start=recording.start,
        end=recording.end,
        deleted_at=None if recording.content is None else recording.content.deleted_at,
        deleted_by=None if recording.content is None else recording.content.deleted_by,
    )
