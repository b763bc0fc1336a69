"""The pictures of the pages, drawn on the server; an image runs no script."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import altair
import numpy as np
import vl_convert
from fastapi import APIRouter, Depends, Query, Request, Response

from core.isolation_layer.equivalent import EquivalentSegment
from service.access.auth import viewer
from service.analyses import history, mode_charts, mode_tracks, queries
from service.analyses.history import CYCLE
from service.buildings import queries as building_queries
from service.db.blobs import decode
from service.db.select import Span
from service.errors import NotFoundError
from service.http.parameters import LARGEST, Reading
from service.http.responses import is_known, tag, unchanged, written
from service.reports import charts as report_charts
from service.version import VERSION

CYCLES = 5000
"""Of a picture: more points are not told apart."""

router = APIRouter(prefix="/charts", include_in_schema=False, dependencies=[Depends(viewer)])


@dataclass(frozen=True, slots=True)
class OneDirection:
    """A building and one of its horizontal directions, as an image's address names them."""

    building: Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
    direction: Annotated[str, Query(pattern="^[xy]$")]


Shown = Annotated[OneDirection, Depends()]


@router.get("/loop.svg")
def loop(request: Request, sessions: Reading, result: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Restoring force over displacement."""
    etag = tag(VERSION, "loop", result)
    if is_known(request, etag):
        return unchanged(etag)
    with sessions() as session:
        rate, displacement, force = queries.loop(session, result)
    displacement, force = decode(displacement), decode(force)
    time = np.arange(force.size) / rate
    return drawn(
        request, report_charts.loop(time=time, displacement=displacement, force=force, title="Restoring force"), etag
    )


@router.get("/orbit.svg")
def orbit(request: Request, sessions: Reading, layer: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Path of the isolation layer in plan."""
    return of_layer(request, sessions, layer, "orbit", ("displacement_x", "displacement_y"), report_charts.orbit)


@router.get("/torsion.svg")
def torsion(request: Request, sessions: Reading, layer: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Torsion of the isolation layer over time."""
    return of_layer(request, sessions, layer, "torsion", ("torsion", "torsion_std"), report_charts.torsion_history)


@router.get("/axial-load.svg")
def axial_load(request: Request, sessions: Reading, layer: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """Vertical load on the isolators over time."""
    return of_layer(request, sessions, layer, "axial-load", ("axial_load",), report_charts.axial_load_history)


def of_layer(
    request: Request,
    sessions: Reading,
    layer: int,
    name: str,
    wanted: tuple[str, ...],
    picture: Callable[..., altair.LayerChart],
) -> Response:
    """A picture of histories across directions, taken as (time, *histories)."""
    etag = tag(VERSION, name, layer)
    if is_known(request, etag):
        return unchanged(etag)
    with sessions() as session:
        found = queries.layer_motion_of(session, layer)
    histories = [decode(blob) for one in wanted if (blob := found._mapping[one]) is not None]
    if len(histories) < len(wanted):
        raise NotFoundError(f"{name} of layer result", layer)
    return drawn(request, picture(np.arange(found.length) / found.rate, *histories), etag)


@router.get("/stiffness.svg")
def stiffness(request: Request, sessions: Reading, shown: Shown) -> Response:
    """Equivalent stiffness over amplitude, the latest cycles of all events."""
    with sessions() as session:
        found, _ = building_queries.building(session, shown.building)
        rows = history.latest_cycles(session, found.id, shown.direction, CYCLES)
    etag = tag(VERSION, "stiffness", shown.building, shown.direction, [row.id for row in rows])
    if is_known(request, etag):
        return unchanged(etag)
    events = defaultdict(list)
    for row in rows:
        events[row.event_start].append(EquivalentSegment(**{name: row._mapping[name] for name in CYCLE}))
    title = "Equivalent stiffness" if len(rows) < CYCLES else f"Equivalent stiffness, the latest {CYCLES} cycles"
    return drawn(request, report_charts.equivalent_stiffness(events, title), etag)


@router.get("/modes.svg")
def modes(request: Request, sessions: Reading, shown: Shown) -> Response:
    """Frequency and damping of each established mode, over time and over the strength of the shaking."""
    with sessions() as session:
        found, _ = building_queries.building(session, shown.building)
        tracked = mode_tracks.tracked_modes(session, found.id, Span(), shown.direction)
    established = [mode for mode in tracked if mode.is_established]
    if not established:
        raise NotFoundError("mode of building", f"{shown.building}, direction {shown.direction}")
    etag = tag(
        VERSION, "modes", shown.building, shown.direction, [(m.frequency, len(m.sightings)) for m in established]
    )
    if is_known(request, etag):
        return unchanged(etag)
    return drawn(request, mode_charts.modes_over_events(established, f"Direction {shown.direction}"), etag)


def drawn(request: Request, chart: report_charts.Picture, etag: str) -> Response:
    """The picture; what it shows changes only with its tag."""
    svg = vl_convert.vegalite_to_svg(chart.to_dict())
    return written(request, svg.encode(), "image/svg+xml", etag)
