"""Files as they came, by the API and on a page: which were read, which were rejected, and why."""

from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query, Request, Response

from service.access.pages import reader
from service.alerts.api import AnyBuilding
from service.buildings import queries as building_queries
from service.buildings.store import described
from service.http.parameters import Before, Code, Limit, Reading
from service.http.rendering import page
from service.http.responses import Format, responses, table
from service.records import recording_queries as files
from service.records.schema import RecordingOut, Recordings
from service.records.tables import Recording, SourceState
from service.shown_addresses import without_credentials

router = APIRouter(tags=["operations"])
pages = APIRouter(include_in_schema=False, dependencies=[Depends(reader)])

LISTED = 100
"""Files of one page."""
AnyFileState = Annotated[Literal["waiting", "read", "rejected"] | None, Query(description="Only files in this state.")]


@router.get("/recordings", operation_id="list_recordings", **responses(Recordings, 404, csv=True))
def every(
    request: Request,
    sessions: Reading,
    building: AnyBuilding = None,
    state: AnyFileState = None,
    cursor: Before = None,
    limit: Limit = 50,
    format: Format = None,
) -> Response:
    """Files as they came, the latest first, with the reason why one could not be used."""
    with sessions() as session:
        of = None if building is None else building_queries.building(session, building)[0].id
        rows = [row(one) for one in files.recordings(session, of, state, cursor, limit)]
    last = str(rows[-1].id) if len(rows) == limit and rows[-1].id > 1 else None
    return table(request, format, tuple(RecordingOut.model_fields), [tuple(dict(one).values()) for one in rows], last)


@pages.get("/buildings/{code}/recordings")
def of_building(
    request: Request, code: Code, sessions: Reading, state: AnyFileState = None, cursor: Before = None
) -> Response:
    """The building's monitoring server, how it is doing, and the files that came from it."""
    with sessions() as session:
        found, _ = building_queries.building(session, code)
        rows = [row(one) for one in files.recordings(session, found.id, state, cursor, LISTED)]
        source = described(session, found).source
        return page(
            request,
            "recordings",
            building=found,
            source=source,
            location=without_credentials(source.location) if source else "",
            doing=session.get(SourceState, found.id),
            rows=rows,
            state=state,
            rejected=files.rejected_counts(session).get(found.id, 0),
            is_later=cursor is not None,
            following=rows[-1].id if len(rows) == LISTED and rows[-1].id > 1 else None,
        )


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
        state=files.STATES[recording.state],
        reason=recording.reason,
        start=recording.start,
        end=recording.end,
    )
