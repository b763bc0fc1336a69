"""The charts of the pages: still pictures, which run no script, specifications of live charts, and numbers."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import altair as alt
import numpy as np
from fastapi import APIRouter, Depends, Query, Response
from sqlalchemy.orm import Session, sessionmaker

from core.arrays import Vector
from core.isolation_layer.equivalent import EquivalentSegment
from service.access.auth import viewer
from service.analyses import history, mode_tracks, queries
from service.analyses.history import CYCLE
from service.analyses.mode_tracks import Sighting, TrackedMode
from service.buildings import queries as building_queries
from service.db.blobs import decode_history
from service.db.select import Span
from service.documents import charts
from service.documents.charts import BLUE, CONFIG, KN
from service.errors import NotFoundError
from service.http.parameters import LARGEST, Reading
from service.http.rendering import As, Form, picture
from service.http.responses import TaggedRoute
from service.models import queries as model_queries

CYCLES = 1500
"""Most points in a picture: more cannot be distinguished."""
PERCENT = 1e2
MARGIN = 0.05
"""Margin above and below the values, as a fraction of a panel's height."""
WIDEST = 42
"""Pixels that the numbers of an axis may take, so that the panels stand in columns."""
FREQUENCY, DAMPING = "frequency (Hz)", "damping ratio (%)"
TIME, FORCE = "event (UTC)", "peak restoring force (kN)"

router = APIRouter(prefix="/charts", include_in_schema=False, dependencies=[Depends(viewer)], route_class=TaggedRoute)


@dataclass(frozen=True, slots=True)
class OneDirection:
    """A building and one of its horizontal directions, as an image's address names them."""

    building: Annotated[str, Query(pattern=r"^[A-Za-z0-9_-]{1,32}$")]
    direction: Annotated[str, Query(pattern="^[xy]$")]


Shown = Annotated[OneDirection, Depends()]
Number = Annotated[int, Query(ge=1, le=LARGEST)]


@router.get("/loop.{form}")
def loop(wanted: As, sessions: Reading, result: Number) -> Response:
    """Restoring force over displacement."""

    def draw() -> charts.Picture:
        with sessions() as session:
            rate, *stored = queries.loop(session, result)
        displacement, force, _ = decoded(stored, "loop of result", result)
        time = np.arange(force.size) / rate
        return charts.loop(time=time, displacement=displacement, force=force, title="Restoring force")

    return picture(wanted, draw, "loop", result)


@router.get("/restoring-force.{form}")
def restoring_force(wanted: As, sessions: Reading, result: Number) -> Response:
    """The loop beside the histories of displacement and force, with the forces of the current models."""
    with sessions() as session:
        of = queries.direction_of(session, result)
        current = model_queries.current_forces(session, of.analysis_id, of.direction)
        modelled = {f"{version.direction} {version.number}": compared.force for version, compared in current}
        identity = [(compared.id, compared.created_at) for _, compared in current]

    def draw() -> charts.Picture:
        with sessions() as session:
            _, *stored = queries.loop(session, result)
        displacement, force, std = decoded(stored, "loop of result", result)
        chart = charts.restoring_force(
            time=np.arange(force.size) / of.rate,
            displacement=displacement,
            force=force,
            std=std,
            title="Restoring force",
            models={name: decode_history(blob) for name, blob in modelled.items()},
        )
        return charts.begun_at(of.begun, chart)

    return picture(wanted, draw, "restoring-force", result, identity)


@router.get("/orbit.{form}")
def orbit(wanted: As, sessions: Reading, layer: Number) -> Response:
    """Path of the isolation layer in plan."""
    return _of_layer(wanted, sessions, layer, "orbit", ("displacement_x", "displacement_y"), charts.orbit)


@router.get("/torsion.{form}")
def torsion(wanted: As, sessions: Reading, layer: Number) -> Response:
    """Torsion of the isolation layer over time."""
    return _of_layer(wanted, sessions, layer, "torsion", ("torsion", "torsion_std"), charts.torsion_history)


@router.get("/axial-load.{form}")
def axial_load(wanted: As, sessions: Reading, layer: Number) -> Response:
    """Vertical load on the isolators over time."""
    return _of_layer(wanted, sessions, layer, "axial-load", ("axial_load",), charts.axial_load_history)


def _of_layer(
    wanted: Form,
    sessions: sessionmaker[Session],
    layer: int,
    name: str,
    series: tuple[str, ...],
    chart: Callable[..., alt.LayerChart],
) -> Response:
    """A picture of histories across directions, drawn by chart(time, *histories)."""

    def draw() -> charts.Picture:
        with sessions() as session:
            row = queries.layer_motion_of(session, layer)
        histories = decoded([row._mapping[one] for one in series], f"{name} of layer result", layer)
        return charts.begun_at(row.start, chart(np.arange(row.length) / row.rate, *histories))

    return picture(wanted, draw, name, layer)


def decoded(blobs: Sequence[bytes | None], what: str, number: int) -> list[Vector]:
    """Stored histories.

    Raises:
        NotFoundError: one was not measured, or is empty, as of an analysis that a later one superseded.
    """
    series = [decode_history(blob) for blob in blobs if blob is not None]
    if len(series) < len(blobs) or not all(one.size for one in series):
        raise NotFoundError(what, number)
    return series


@router.get("/stiffness.{form}")
def stiffness(wanted: As, sessions: Reading, shown: Shown) -> Response:
    """Equivalent stiffness over amplitude, the latest cycles of all events."""
    with sessions() as session:
        building, _ = building_queries.building(session, shown.building)
        rows = history.latest_cycles(session, building.id, shown.direction, CYCLES)

    def draw() -> charts.Picture:
        events = defaultdict(list)
        for row in rows:
            events[row.event_start].append(EquivalentSegment(**{name: row._mapping[name] for name in CYCLE}))
        title = "Equivalent stiffness" if len(rows) < CYCLES else f"Equivalent stiffness, the latest {CYCLES} cycles"
        return charts.equivalent_stiffness(events, title)

    return picture(wanted, draw, "stiffness", shown, [row.id for row in rows])


@router.get("/modes.{form}")
def modes(wanted: As, sessions: Reading, shown: Shown) -> Response:
    """Frequency and damping of each established mode, over time and over the strength of the shaking."""
    with sessions() as session:
        building, _ = building_queries.building(session, shown.building)
        tracked = mode_tracks.tracked_modes(session, building.id, Span(), shown.direction, mode_tracks.SHOWN)
    established = [mode for mode in tracked if mode.is_established]
    if not established:
        raise NotFoundError("mode of building", f"{shown.building}, direction {shown.direction}")
    title = f"Direction {shown.direction}"
    identity = [(mode.frequency, len(mode.sightings)) for mode in established]
    return picture(wanted, lambda: modes_over_events(established, title), "modes", shown, identity)


def modes_over_events(modes: Sequence[TrackedMode], title: str) -> alt.VConcatChart:
    """A row of four panels for each mode, at least one; bars are ± 1 standard deviation."""
    rows = [_panels(mode) for mode in modes]
    heading = alt.Title(title, subtitle="bars are ± 1 standard deviation", offset=14)
    return alt.vconcat(*rows, title=heading, spacing=30, config=CONFIG)


def _panels(mode: TrackedMode) -> alt.HConcatChart:
    rows = [_row(sighting) for sighting in mode.sightings]
    panels = [_panel(rows, value, across) for value in (FREQUENCY, DAMPING) for across in (TIME, FORCE)]
    heading = alt.Title(f"Mode {mode.number}: {mode.frequency:.3g} Hz, {mode.damping_ratio * PERCENT:.2g} %")
    return alt.hconcat(*panels, title=heading, spacing=18)


def _panel(rows: Sequence[dict[str, float]], value: str, across: str) -> alt.LayerChart:
    data, name = charts.values(rows), "frequency" if value == FREQUENCY else "damping"
    low, high = min(row[f"{name}_low"] for row in rows), max(row[f"{name}_high"] for row in rows)
    # Of a bar's two ends only one would be counted by itself.
    scale = alt.Scale(domain=[low - MARGIN * (high - low), high + MARGIN * (high - low)], zero=False, nice=False)
    x = (
        alt.X("start:T", title=across, axis=alt.Axis(format="%Y-%m", tickCount=3)).scale(type="utc", padding=10)
        if across == TIME
        else alt.X("force:Q", title=across, axis=alt.Axis(tickCount=3)).scale(type="log", nice=False, padding=10)
    )
    y = alt.Y(f"{name}_low:Q", title=value, scale=scale, axis=alt.Axis(minExtent=WIDEST, tickCount=5))
    bars = alt.Chart(data).mark_rule(color=BLUE, opacity=0.4).encode(x, y, y2=f"{name}_high:Q")
    points = alt.Chart(data).mark_circle(color=BLUE, size=36, opacity=0.8)
    tooltip = [
        alt.Tooltip("start:T", title=TIME, format="%Y-%m-%d %H:%M:%S"),
        alt.Tooltip("force:Q", title=FORCE, format=".4~g"),
        alt.Tooltip(f"{name}:Q", title=value, format=".4~g"),
    ]
    points = points.encode(x, alt.Y(f"{name}:Q", title=value), tooltip=tooltip)
    return alt.LayerChart(layer=[bars, points], width=200, height=150)


def _row(sighting: Sighting) -> dict[str, float]:
    mode = sighting.mode
    frequency_std, damping_std = mode.frequency_std or 0.0, mode.damping_ratio_std or 0.0
    return {
        "start": sighting.event_start.timestamp() * 1e3,
        "force": sighting.peak_force * KN,
        "frequency": mode.frequency,
        "frequency_low": mode.frequency - frequency_std,
        "frequency_high": mode.frequency + frequency_std,
        "damping": mode.damping_ratio * PERCENT,
        "damping_low": (mode.damping_ratio - damping_std) * PERCENT,
        "damping_high": (mode.damping_ratio + damping_std) * PERCENT,
    }
