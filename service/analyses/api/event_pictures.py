"""Charts of one earthquake, and of two beside each other."""

from functools import partial
from typing import Annotated

import numpy as np
from fastapi import APIRouter, Depends, Query, Response
from sqlalchemy.orm import Session

from core.description import BuildingDescription
from service.access.auth import viewer
from service.analyses import document, event_charts, history, queries
from service.analyses.api.pictures import CYCLES, Number, decoded
from service.analyses.event_charts import Trace
from service.analyses.schema import ShakingOut
from service.buildings.store import described
from service.db.blobs import decode
from service.documents.charts import Picture, begun_at
from service.drift import charts as drift_charts, queries as drift_queries
from service.drift.baseline import baseline_answer
from service.errors import NotFoundError
from service.http.parameters import LARGEST, Reading
from service.http.rendering import As, picture
from service.http.responses import TaggedRoute
from service.records import queries as record_queries
from service.records.tables import Event, Waveform

MOST_CHANNELS = 6
"""Channels of one chart: more would take more than a few hundred kilobytes."""
CYCLE_TITLES = {"k_eq": "Equivalent stiffness k_eq", "c_eq": "Equivalent damping c_eq"}
CURVE = 80
"""Amplitudes of the expected curve."""
MONITORED = {"k_eq": "stiffness", "c_eq": "damping"}
CYCLE_LABELS = {"k_eq": "equivalent stiffness k_eq (kN/mm)", "c_eq": "equivalent damping c_eq (kN s/mm)"}

router = APIRouter(prefix="/charts", include_in_schema=False, dependencies=[Depends(viewer)], route_class=TaggedRoute)

ChannelName = Annotated[str, Query(max_length=64, pattern=r"^[A-Za-z0-9._-]+$")]
Channels = Annotated[list[ChannelName], Query(min_length=1, max_length=MOST_CHANNELS)]
Other = Annotated[int | None, Query(ge=1, le=LARGEST)]


@router.get("/waveforms.{form}")
def waveforms(wanted: As, sessions: Reading, event: Number, channel: Channels) -> Response:
    """Channels of an earthquake as recorded."""
    names = list(dict.fromkeys(channel))
    with sessions() as session:
        of, description = _of(session, event)
        pieces = {name: record_queries.channel(session, event, name)[1] for name in names}
    known = {one.id: one for one in description.channels}

    def draw() -> Picture:
        shown = {}
        for name, each in pieces.items():
            sensor = known.get(name)
            place = f" ({sensor.level}, {sensor.direction or sensor.quantity})" if sensor else ""
            quantity = sensor.quantity if sensor else "as recorded"
            shown[name + place] = (quantity, [_trace(piece, of) for piece in each])
        return begun_at(of.start, event_charts.waveforms(shown))

    identity = [(piece.id, known.get(name)) for name, each in pieces.items() for piece in each]
    return picture(wanted, draw, "waveforms", identity)


def _trace(piece: Waveform, event: Event) -> Trace:
    samples = decode(piece.samples).astype(float) * piece.gain
    return Trace((piece.start - event.start).total_seconds(), piece.rate, samples)


@router.get("/spectra.{form}")
def spectra(wanted: As, sessions: Reading, event: Number, other: Other = None) -> Response:
    """Response spectra of an earthquake, and of another one."""
    with sessions() as session:
        both = {one: _shaking(session, one) for one in (event, other) if one is not None}
    names = {one: f"{of.start:%Y-%m-%d %H:%M:%S}, " if other else "" for one, (of, _) in both.items()}
    curves = {
        f"{names[one]}{shaking.level}, {direction}": (shaking.periods, each)
        for one, (_, shaking) in both.items()
        for direction, each in shaking.spectrum.items()
        if each
    }
    return picture(wanted, lambda: event_charts.spectra(curves), "spectra", curves)


@router.get("/peaks.{form}")
def peaks(wanted: As, sessions: Reading, event: Number) -> Response:
    """Largest acceleration of each floor and drift of each storey."""
    with sessions() as session:
        of, shaking = _shaking(session, event)
        description = described(session, of.building).description
    floors = [one.model_dump() for one in shaking.floors]
    storeys = [one.model_dump() for one in shaking.storeys]
    heights = {level.name: level.height for level in description.floors}
    if not floors:
        raise NotFoundError("floor acceleration of event", event)

    def draw() -> Picture:
        return event_charts.peaks_over_height(floors, storeys, heights)

    return picture(wanted, draw, "peaks", (floors, storeys, heights))


@router.get("/force-parts.{form}")
def force_parts(wanted: As, sessions: Reading, result: Number) -> Response:
    """The restoring force over time with its band, and its parts."""
    names = ("force", "force_std_history", "force_rigid", "force_modal")
    with sessions() as session:
        of = queries.direction_of(session, result)
        stored = queries.histories(session, result, names)

    def draw() -> Picture:
        force, std, rigid, modal = decoded(stored, "history of result", result)
        time = np.arange(force.size) / of.rate
        chart = event_charts.parts_of_force(time=time, force=force, std=std, rigid=rigid, modal=modal)
        return begun_at(of.begun, chart)

    return picture(wanted, draw, "force-parts", result)


@router.get("/cycles.{form}")
def cycles(
    wanted: As,
    sessions: Reading,
    event: Number,
    direction: Annotated[str, Query(pattern="^[xy]$")],
    quantity: Annotated[str, Query(pattern="^(k|c)_eq$")] = "k_eq",
) -> Response:
    """Cycles of an earthquake among those of all others, on what was expected at its temperature."""
    with sessions() as session:
        of, analysis = record_queries.event_with_analysis(session, event)
        rows = history.latest_cycles(session, of.building_id, direction, CYCLES)
        series = drift_queries.every_series(session, of.building_id)
        name = (MONITORED[quantity], direction)
        monitored = next((one for one in series if (one.quantity, one.subject) == name), None)
        code, temperature = of.building.code, analysis.temperature if analysis else None

    def draw() -> Picture:
        names = (CYCLE_TITLES[quantity], CYCLE_LABELS[quantity])
        known = None if monitored is None else baseline_answer(code, monitored, temperature, CURVE)
        expected = partial(drift_charts.expected, known) if known and known.items else None
        return event_charts.cycles(rows, of.start, quantity, names, expected)

    version = monitored and (monitored.id, monitored.job_id)
    return picture(wanted, draw, "cycles", (event, direction, quantity), version, [row.id for row in rows])


@router.get("/loops.{form}")
def loops(wanted: As, sessions: Reading, result: Number, other: Other = None) -> Response:
    """The loop of an earthquake with an axis of shear strain, and that of another earthquake."""
    with sessions() as session:
        found = {one: queries.direction_of(session, one) for one in (result, other) if one is not None}
        stored = {one: queries.loop(session, one) for one in found}
        height = _of(session, found[result].event)[1].isolation.rubber_height

    def draw() -> Picture:
        by_name = {}
        for number, row in found.items():
            blobs = (stored[number].displacement, stored[number].force)
            displacement, force = decoded(blobs, "loop of result", number)
            by_name[f"{row.start:%Y-%m-%d %H:%M:%S}, {row.direction}"] = (displacement, force)
        if other is not None:
            return event_charts.overlaid_loops(by_name, "Loops of two earthquakes", height)
        one = found[result]
        return begun_at(one.begun, event_charts.overlaid_loops(by_name, "Loop and shear strain", height, one.rate))

    return picture(wanted, draw, "loops", result, other, height)


def _of(session: Session, event: int) -> tuple[Event, BuildingDescription]:
    of = record_queries.event(session, event)
    return of, described(session, of.building).description


def _shaking(session: Session, event: int) -> tuple[Event, ShakingOut]:
    of, analysis = record_queries.event_with_analysis(session, event)
    shaking = document.shaking_out(queries.shaking_result(session, analysis.id)) if analysis else None
    if shaking is None:
        raise NotFoundError("strength of shaking of event", event)
    return of, shaking
