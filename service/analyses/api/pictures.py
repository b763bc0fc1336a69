"""The pictures of the pages, drawn on the server; an image runs no script."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import altair
import numpy as np
from fastapi import APIRouter, Depends, Query
from sqlalchemy.orm import Session, sessionmaker

from core.isolation_layer.equivalent import EquivalentSegment
from service.access.auth import viewer
from service.analyses import history, mode_charts, mode_tracks, queries
from service.analyses.history import CYCLE
from service.buildings import queries as building_queries
from service.db.blobs import decode_history
from service.db.select import Span
from service.errors import NotFoundError
from service.http.parameters import LARGEST, Reading
from service.http.rendering import picture
from service.http.responses import Tagged, TaggedRoute
from service.reports import charts

CYCLES = 5000
"""Most points in a picture: more cannot be distinguished."""

router = APIRouter(prefix="/charts", include_in_schema=False, dependencies=[Depends(viewer)], route_class=TaggedRoute)


@dataclass(frozen=True, slots=True)
class OneDirection:
    """A building and one of its horizontal directions, as an image's address names them."""

    building: Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
    direction: Annotated[str, Query(pattern="^[xy]$")]


Shown = Annotated[OneDirection, Depends()]
Number = Annotated[int, Query(ge=1, le=LARGEST)]


@router.get("/loop.svg")
def loop(sessions: Reading, result: Number) -> Tagged:
    """Restoring force over displacement."""

    def draw() -> charts.Picture:
        with sessions() as session:
            rate, *stored = queries.loop(session, result)
        displacement, force = (decode_history(one) for one in stored)
        time = np.arange(force.size) / rate
        return charts.loop(time=time, displacement=displacement, force=force, title="Restoring force")

    return picture(draw, "loop", result)


@router.get("/orbit.svg")
def orbit(sessions: Reading, layer: Number) -> Tagged:
    """Path of the isolation layer in plan."""
    return _of_layer(sessions, layer, "orbit", ("displacement_x", "displacement_y"), charts.orbit)


@router.get("/torsion.svg")
def torsion(sessions: Reading, layer: Number) -> Tagged:
    """Torsion of the isolation layer over time."""
    return _of_layer(sessions, layer, "torsion", ("torsion", "torsion_std"), charts.torsion_history)


@router.get("/axial-load.svg")
def axial_load(sessions: Reading, layer: Number) -> Tagged:
    """Vertical load on the isolators over time."""
    return _of_layer(sessions, layer, "axial-load", ("axial_load",), charts.axial_load_history)


def _of_layer(
    sessions: sessionmaker[Session],
    layer: int,
    name: str,
    wanted: tuple[str, ...],
    chart: Callable[..., altair.LayerChart],
) -> Tagged:
    """A picture of histories across directions, drawn by chart(time, *histories)."""

    def draw() -> charts.Picture:
        with sessions() as session:
            found = queries.layer_motion_of(session, layer)
        histories = [decode_history(blob) for one in wanted if (blob := found._mapping[one]) is not None]
        if len(histories) < len(wanted):
            raise NotFoundError(f"{name} of layer result", layer)
        return chart(np.arange(found.length) / found.rate, *histories)

    return picture(draw, name, layer)


@router.get("/stiffness.svg")
def stiffness(sessions: Reading, shown: Shown) -> Tagged:
    """Equivalent stiffness over amplitude, the latest cycles of all events."""
    with sessions() as session:
        found, _ = building_queries.building(session, shown.building)
        rows = history.latest_cycles(session, found.id, shown.direction, CYCLES)

    def draw() -> charts.Picture:
        events = defaultdict(list)
        for row in rows:
            events[row.event_start].append(EquivalentSegment(**{name: row._mapping[name] for name in CYCLE}))
        title = "Equivalent stiffness" if len(rows) < CYCLES else f"Equivalent stiffness, the latest {CYCLES} cycles"
        return charts.equivalent_stiffness(events, title)

    return picture(draw, "stiffness", shown, [row.id for row in rows])


@router.get("/modes.svg")
def modes(sessions: Reading, shown: Shown) -> Tagged:
    """Frequency and damping of each established mode, over time and over the strength of the shaking."""
    with sessions() as session:
        found, _ = building_queries.building(session, shown.building)
        tracked = mode_tracks.tracked_modes(session, found.id, Span(), shown.direction)
    established = [mode for mode in tracked if mode.is_established]
    if not established:
        raise NotFoundError("mode of building", f"{shown.building}, direction {shown.direction}")
    title = f"Direction {shown.direction}"
    identity = [(mode.frequency, len(mode.sightings)) for mode in established]
    return picture(lambda: mode_charts.modes_over_events(established, title), "modes", shown, identity)
