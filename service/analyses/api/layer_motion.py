"""The isolation layer's motion in plan over time, and the vertical load on it."""

from typing import Annotated, Literal, get_args

import orjson
from fastapi import APIRouter, Query, Request, Response

from service.analyses import layer_queries
from service.analyses.api.series import kept, sampled
from service.analyses.series_schema import LayerMotionSeries
from service.db.blobs import decode
from service.http import numbers
from service.http.parameters import AnalysisId, Id, Points, Reading
from service.http.responses import (
    OPTIONS,
    Format,
    is_known,
    responses,
    series_lines,
    tag,
    unchanged,
    wants_csv,
    written,
)
from service.version import VERSION

Name = Literal["displacement_x", "displacement_y", "torsion", "torsion_std", "axial_load"]
NAMES: tuple[str, ...] = get_args(Name)
Names = Annotated[list[Name] | None, Query(description="Only these series; repeat the parameter for several.")]

router = APIRouter(prefix="/events", tags=["series"])


@router.get("/{event_id}/layer-motion", operation_id="get_layer_motion", **responses(LayerMotionSeries, 404, csv=True))
def layer_motion(
    request: Request,
    event_id: Id,
    sessions: Reading,
    series: Names = None,
    points: Points = None,
    analysis: AnalysisId = None,
    format: Format = None,
) -> Response:
    """Displacement in x and y, torsion, and the vertical load; sample i is at start + i · step unless `time` is given.

    There is one where the displacement is known in x and y, or the torsion, or the vertical load.
    """
    names = [name for name in NAMES if series is None or name in series]
    csv = wants_csv(request, format)
    with sessions() as session:
        result = layer_queries.layer_motion(session, event_id, analysis)
    etag = tag(VERSION, "layer-motion", result.id, names, points, csv)
    if is_known(request, etag):
        return unchanged(etag)
    found = {name: decode(blob) for name in names if (blob := result._mapping[name]) is not None}
    chosen = kept(found, result.length, points)
    if csv:
        return written(request, series_lines(sampled(result, found, chosen)), "text/csv", etag)
    thinned = {name: numbers.written(one if chosen is None else one[chosen]) for name, one in found.items()}
    content = dict.fromkeys(NAMES) | {
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
