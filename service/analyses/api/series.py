"""Series of an event: the restoring force, the layer's motion in plan, and the channels as recorded."""

from typing import Annotated, Literal, get_args

import numpy as np
from fastapi import APIRouter, Query, Request

from service.analyses import queries
from service.analyses.series_schema import ForceSeries, LayerMotionSeries, Piece, WaveformSeries
from service.buildings.store import described
from service.db.blobs import decode, decode_history
from service.http.parameters import AnalysisId, ChannelId, HorizontalDirection, Id, Points, Reading
from service.http.responses import CSV, JSON, Format, Tagged, TaggedRoute, responses, wants_csv
from service.http.series import Histories, histories, joined_lines, written
from service.records import queries as record_queries
from service.records.tables import Waveform

router = APIRouter(prefix="/events", tags=["series"], route_class=TaggedRoute)

Name = Literal[
    "displacement",
    "displacement_std",
    "velocity",
    "velocity_std",
    "force",
    "force_rigid",
    "force_modal",
    "force_std",
]
NAMES: tuple[str, ...] = get_args(Name)
COLUMN = {name: f"{name}_history" for name in ("displacement_std", "velocity_std", "force_std")}
ONLY = Query(description="Only these series; repeat the parameter for several.")
Names = Annotated[list[Name] | None, ONLY]
LayerName = Literal["displacement_x", "displacement_y", "torsion", "torsion_std", "axial_load"]
LAYER_NAMES: tuple[str, ...] = get_args(LayerName)
LayerNames = Annotated[list[LayerName] | None, ONLY]


@router.get("/{event_id}/restoring-force", operation_id="get_restoring_force", **responses(ForceSeries, 404, csv=True))
def restoring_force(
    request: Request,
    event_id: Id,
    direction: HorizontalDirection,
    sessions: Reading,
    series: Names = None,
    points: Points = None,
    analysis: AnalysisId = None,
    format: Format = None,
) -> Tagged:
    """Motion and restoring force of the isolation layer; sample i is at start + i · step unless `time` is given."""
    names = [name for name in NAMES if series is None or name in series]
    csv = wants_csv(request, format)
    with sessions() as session:
        result = queries.restoring_force(session, event_id, direction, analysis)

    def make() -> bytes:
        with sessions() as session:
            stored = queries.histories(session, result.id, [COLUMN.get(name, name) for name in names])
        decoded = {name: decode_history(blob) for name, blob in zip(names, stored, strict=True) if blob is not None}
        measured = result.peak_displacement is not None
        return histories(decoded, result.rate, result.length, points).answer(
            ForceSeries,
            as_csv=csv,
            **dict.fromkeys(names),
            event=result.event,
            building=result.building,
            direction=result.direction,
            analysis=result.analysis,
            estimator=result.estimator,
            start=result.start,
            missing=None if measured else "no channel measures the displacement of the isolation layer",
        )

    return Tagged(make, CSV if csv else JSON, "restoring-force", result.id, names, points)


@router.get("/{event_id}/layer-motion", operation_id="get_layer_motion", **responses(LayerMotionSeries, 404, csv=True))
def layer_motion(
    request: Request,
    event_id: Id,
    sessions: Reading,
    series: LayerNames = None,
    points: Points = None,
    analysis: AnalysisId = None,
    format: Format = None,
) -> Tagged:
    """Displacement in x and y, torsion, and the vertical load; sample i is at start + i · step unless `time` is given.

    There is one where the displacement is known in x and y, or the torsion, or the vertical load.
    """
    names = [name for name in LAYER_NAMES if series is None or name in series]
    csv = wants_csv(request, format)
    with sessions() as session:
        result = queries.layer_motion(session, event_id, analysis)

    def make() -> bytes:
        decoded = {name: decode_history(blob) for name in names if (blob := result._mapping[name]) is not None}
        return histories(decoded, result.rate, result.length, points).answer(
            LayerMotionSeries,
            as_csv=csv,
            **dict.fromkeys(LAYER_NAMES),
            event=result.event,
            building=result.building,
            analysis=result.analysis,
            start=result.start,
            axial_load_level=result.axial_load_level,
        )

    return Tagged(make, CSV if csv else JSON, "layer-motion", result.id, names, points)


@router.get("/{event_id}/waveforms/{channel}", operation_id="get_waveform", **responses(WaveformSeries, 404, csv=True))
def waveform(
    request: Request, event_id: Id, channel: ChannelId, sessions: Reading, points: Points = None, format: Format = None
) -> Tagged:
    """A channel as recorded, in SI units; CSV counts time from the event's start."""
    csv = wants_csv(request, format)
    with sessions() as session:
        event, pieces = record_queries.channel(session, event_id, channel)
        channels = described(session, event.building).description.channels
    sensor = next((one for one in channels if one.id == channel), None)

    def make() -> bytes:
        shown = [_samples(piece, points) for piece in pieces]
        if csv:
            offsets = [(piece.start - event.start).total_seconds() for piece in pieces]
            return joined_lines(list(zip(offsets, shown, strict=True)))
        is_finite = all(np.isfinite(one.shown["samples"]).all() for one in shown)
        answer = WaveformSeries(
            event=event_id,
            channel=channel,
            level=sensor.level if sensor else None,
            quantity=sensor.quantity if sensor else None,
            direction=sensor.direction if sensor else None,
            pieces=[],
            missing=None if is_finite else "the sensor gave no finite number",
        )
        content = [one.content(Piece, start=piece.start) for piece, one in zip(pieces, shown, strict=True)]
        return written(answer.model_dump() | {"pieces": content})

    identity = [(piece.id, sensor) for piece in pieces]
    return Tagged(make, CSV if csv else JSON, "waveform", identity, points)


def _samples(piece: Waveform, points: int | None) -> Histories:
    """The samples of a piece, SI units."""
    samples = decode(piece.samples).astype(float) * piece.gain
    return histories({"samples": samples}, piece.rate, samples.size, points)
