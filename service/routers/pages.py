"""The first page: buildings, the last event, its loop and the equivalent stiffness; no JavaScript."""

from collections import defaultdict
from pathlib import Path
from typing import Annotated

import altair
import numpy as np
import vl_convert
from fastapi import APIRouter, Query, Request, Response
from fastapi.templating import Jinja2Templates

from core.equivalent import EquivalentSegment
from service import charts, queries
from service.answers import is_known, tag, unchanged, written
from service.blobs import decode
from service.parameters import LARGEST, Reading
from service.queries import CYCLE, Span
from service.version import VERSION

FOLDER = Path(__file__).parents[1] / "pages"
TEMPLATES = Jinja2Templates(FOLDER / "templates")
POLICY = {
    "Content-Security-Policy": "default-src 'none'; img-src 'self'; style-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
CYCLES = 5000  # more points than that are not told apart in a picture

router = APIRouter(include_in_schema=False)
BuildingCode = Annotated[str | None, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")]


@router.get("/")
def home(request: Request, sessions: Reading, building: BuildingCode = None) -> Response:
    """Every building, and the last event of the one that is named, or of the one that shook last."""
    with sessions() as session:
        found = queries.buildings(session)
        shaken = [row for row in found if row[3] is not None]
        shown = queries.building(session, building)[0] if building else None
        if shown is None and shaken:
            shown = max(shaken, key=lambda row: row[3])[0]
        event = queries.last_analysed(session, shown.id) if shown else None
        analysis = next((a for a in queries.analyses(session, event.id) if a.current), None) if event else None
        results = queries.direction_results(session, analysis.id) if analysis else []
        context = {"buildings": found, "event": event, "analysis": analysis, "results": results}
        return TEMPLATES.TemplateResponse(request, "home.html", context, headers=POLICY)


@router.get("/docs")
async def docs(request: Request) -> Response:
    """The OpenAPI document for people, without a CDN."""
    return TEMPLATES.TemplateResponse(request, "docs.html", {"document": request.app.openapi()}, headers=POLICY)


@router.get("/charts/loop.svg")
def loop(request: Request, sessions: Reading, result: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Restoring force over displacement."""
    etag = tag(VERSION, "loop", result)
    if is_known(request, etag):
        return unchanged(etag)
    with sessions() as session:
        rate, displacement, force = queries.loop(session, result)
    displacement, force = decode(displacement), decode(force)
    time = np.arange(force.size) / rate
    return drawn(request, charts.loop(time=time, displacement=displacement, force=force, title="Restoring force"), etag)


@router.get("/charts/stiffness.svg")
def stiffness(
    request: Request,
    sessions: Reading,
    building: Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")],
    direction: Annotated[str, Query(pattern="^[xy]$")],
) -> Response:
    """Equivalent stiffness over amplitude, every cycle of every event."""
    with sessions() as session:
        found, _ = queries.building(session, building)
        rows = queries.cycles(session, found.id, Span(), direction, None, CYCLES)
    etag = tag(VERSION, "stiffness", building, direction, [row.id for row in rows])
    if is_known(request, etag):
        return unchanged(etag)
    events = defaultdict(list)
    for row in rows:
        events[row.event_start].append(EquivalentSegment(**{name: row._mapping[name] for name in CYCLE}))
    return drawn(request, charts.equivalent_stiffness(events, "Equivalent stiffness"), etag)


def drawn(request: Request, chart: altair.LayerChart, etag: str) -> Response:
    """The picture; it runs no script, being an image."""
    svg = vl_convert.vegalite_to_svg(chart.to_dict())
    return written(request, svg.encode(), "image/svg+xml", etag)
