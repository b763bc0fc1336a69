"""Series of an event: the restoring force, the layer's motion in plan, and the channels as recorded."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, get_args

import numpy as np
import orjson
from fastapi import APIRouter, Query, Request, Response

from core.arrays import Indices, Vector
from service.analyses import queries
from service.analyses.series_schema import ForceSeries, LayerMotionSeries, WaveformSeries
from service.buildings.store import described
from service.db.blobs import decode
from service.db.select import Line
from service.http.parameters import AnalysisId, ChannelId, HorizontalDirection, Id, Points, Reading
from service.http.responses import (
    OPTIONS,
    Answers,
    Format,
    is_known,
    responses,
    rounded,
    series_json,
    series_lines,
    tag,
    unchanged,
    wants_csv,
    written,
)
from service.records import queries as record_queries
from service.records.tables import Waveform
from service.reports.thinning import extremes
from service.version import VERSION

router = APIRouter(prefix="/events", tags=["series"])

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
LayerNames = Annotated[
    list[LayerName] | None, Query(description="Only these series; repeat the parameter for several.")
]


def kept(series: Mapping[str, Vector], count: int, points: int | None) -> Indices | None:
    """Samples that stay: together they hold the extremes of every pixel of each series. None where all do."""
    if points is None or count <= points or not series:
        return None
    return np.unique(np.concatenate([extremes(one, points // len(series)) for one in series.values()]))


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
) -> Response:
    """Motion and restoring force of the isolation layer; sample i is at start + i · step unless `time` is given."""
    names = [name for name in NAMES if series is None or name in series]
    answers: Answers = request.app.state.answers
    csv = wants_csv(request, format)
    media_type = "text/csv" if csv else "application/json"
    with sessions() as session:
        result = queries.restoring_force(session, event_id, direction, analysis)
        etag = tag(VERSION, result.id, names, points, csv)
        if is_known(request, etag):
            return unchanged(etag)
        body = answers.find(etag)
        if body is not None:
            return written(request, body, media_type, etag)
        stored = queries.histories(session, result.id, [COLUMN.get(name, name) for name in names])
    found = {name: decode(blob) for name, blob in zip(names, stored, strict=True) if blob is not None}
    chosen = kept(found, result.length, points)
    body = series_lines(sampled(result, found, chosen)) if csv else force_document(result, names, found, chosen)
    answers.keep(etag, body)
    return written(request, body, media_type, etag)


def sampled(result: Line, found: Mapping[str, Vector], chosen: Indices | None) -> dict[str, Vector]:
    """Time and histories as columns, of the samples that were chosen or of all."""
    time = (np.arange(result.length) if chosen is None else chosen) / result.rate
    return {"time": time} | {name: rounded(one if chosen is None else one[chosen]) for name, one in found.items()}


def force_document(result: Line, names: Sequence[str], found: Mapping[str, Vector], chosen: Indices | None) -> bytes:
    """The answer as JSON, of the samples that were chosen or of all; a series that is not stored is null."""
    series = {name: series_json(one if chosen is None else one[chosen]) for name, one in found.items()}
    time = None if chosen is None else chosen / result.rate
    content = dict.fromkeys(names) | described_force(result) | {"time": time} | series
    return orjson.dumps(content, option=OPTIONS)


def described_force(result: Line) -> dict[str, Any]:
    """All of the answer but the series."""
    measured = result.peak_displacement is not None
    return {
        "event": result.event,
        "building": result.building,
        "direction": result.direction,
        "analysis": result.analysis,
        "estimator": result.estimator,
        "start": result.start,
        "rate": result.rate,
        "step": 1 / result.rate,
        "count": result.length,
        "missing": None if measured else "no channel measures the displacement of the isolation layer",
    }


@router.get("/{event_id}/layer-motion", operation_id="get_layer_motion", **responses(LayerMotionSeries, 404, csv=True))
def layer_motion(
    request: Request,
    event_id: Id,
    sessions: Reading,
    series: LayerNames = None,
    points: Points = None,
    analysis: AnalysisId = None,
    format: Format = None,
) -> Response:
    """Displacement in x and y, torsion, and the vertical load; sample i is at start + i · step unless `time` is given.

    There is one where the displacement is known in x and y, or the torsion, or the vertical load.
    """
    names = [name for name in LAYER_NAMES if series is None or name in series]
    csv = wants_csv(request, format)
    with sessions() as session:
        result = queries.layer_motion(session, event_id, analysis)
    etag = tag(VERSION, "layer-motion", result.id, names, points, csv)
    if is_known(request, etag):
        return unchanged(etag)
    found = {name: decode(blob) for name in names if (blob := result._mapping[name]) is not None}
    chosen = kept(found, result.length, points)
    if csv:
        return written(request, series_lines(sampled(result, found, chosen)), "text/csv", etag)
    thinned = {name: series_json(one if chosen is None else one[chosen]) for name, one in found.items()}
    content = dict.fromkeys(LAYER_NAMES) | {
        "event": result.event,
        "building": result.building,
        "analysis": result.analysis,
        "start": result.start,
        "rate": result.rate,
        "step": 1 / result.rate,
        "count": result.length,
        "time": None if chosen is None else chosen / result.rate,
        "axial_load_level": result.axial_load_level,
    }
    return written(request, orjson.dumps(content | thinned, option=OPTIONS), "application/json", etag)


@router.get("/{event_id}/waveforms/{channel}", operation_id="get_waveform", **responses(WaveformSeries, 404, csv=True))
def waveform(
    request: Request, event_id: Id, channel: ChannelId, sessions: Reading, points: Points = None, format: Format = None
) -> Response:
    """A channel as recorded, in SI units; CSV counts time from the event's start."""
    with sessions() as session:
        event, pieces = record_queries.channel(session, event_id, channel)
        etag = tag(VERSION, [piece.id for piece in pieces], points, wants_csv(request, format))
        if is_known(request, etag):
            return unchanged(etag)
        channels = described(session, event.building).description.channels
    sensor = next((one for one in channels if one.id == channel), None)
    series = [thinned(piece, points) for piece in pieces]
    if wants_csv(request, format):
        offsets = [(piece.start - event.start).total_seconds() for piece in pieces]
        times = [offset + time for offset, (time, _) in zip(offsets, series, strict=True)]
        lines = {
            "time": np.concatenate(times),
            "samples": np.concatenate([rounded(samples) for _, samples in series]),
        }
        return written(request, series_lines(lines), "text/csv", etag)
    content = {
        "event": event_id,
        "channel": channel,
        "level": sensor and sensor.level,
        "quantity": sensor and sensor.quantity,
        "direction": sensor and sensor.direction,
        "pieces": [described_piece(*pair) for pair in zip(pieces, series, strict=True)],
        "missing": "the sensor gave no finite number" if any(~np.isfinite(one).all() for _, one in series) else None,
    }
    return written(request, orjson.dumps(content, option=OPTIONS), "application/json", etag)


def thinned(piece: Waveform, points: int | None) -> tuple[Vector, Vector]:
    """(n,) s after the piece's start and (n,) SI units, of the samples that stay."""
    samples = decode(piece.samples).astype(float) * piece.gain
    chosen = kept({"samples": samples}, samples.size, points)
    indices = np.arange(samples.size) if chosen is None else chosen
    return indices / piece.rate, samples[indices]


def described_piece(piece: Waveform, series: tuple[Vector, Vector]) -> dict[str, Any]:
    """A piece with its samples; time only where they are not regular."""
    time, samples = series
    return {
        "start": piece.start,
        "rate": piece.rate,
        "step": 1 / piece.rate,
        "count": piece.count,
        "time": None if samples.size == piece.count else time,
        "samples": series_json(samples),
    }
