"""The pictures of the models' pages, drawn on the server."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from service.access.auth import viewer
from service.analyses.api.pictures import drawn
from service.db.blobs import decode
from service.http.parameters import LARGEST, Reading
from service.http.responses import is_known, tag, unchanged
from service.models import answers, charts, queries
from service.version import VERSION

router = APIRouter(prefix="/charts", include_in_schema=False, dependencies=[Depends(viewer)])


@router.get("/model-loop.svg")
def loop(request: Request, sessions: Reading, comparison: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """The model's force beside the estimated one, over displacement."""
    with sessions() as session:
        found = queries.comparison(session, comparison)
        etag = tag(VERSION, "model-loop", found.id, found.created_at)
        if is_known(request, etag):
            return unchanged(etag)
        measured = queries.measured(session, found.analysis_id, found.direction)
    title = f"{found.event.start:%Y-%m-%d %H:%M:%S} UTC, direction {found.direction}"
    chart = charts.loops(
        displacement=decode(measured.displacement),
        measured=decode(measured.force),
        modelled=decode(found.force),
        title=title,
    )
    return drawn(request, chart, etag)


@router.get("/model-trend.svg")
def trend(request: Request, sessions: Reading, model: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """The model's error beyond noise, event by event."""
    with sessions() as session:
        compared = queries.latest_comparisons(session, [model])[model]
    etag = tag(VERSION, "model-trend", model, [(one.id, one.created_at) for one, _ in compared])
    if is_known(request, etag):
        return unchanged(etag)
    return drawn(request, charts.trend(answers.judged(compared)), etag)
