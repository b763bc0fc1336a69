"""Comparisons of models with events, their force series, and diagnoses of models."""

from typing import Annotated

import numpy as np
import orjson
from fastapi import APIRouter, Path, Request, Response

from service.analyses.api.series import kept
from service.db.blobs import decode
from service.http.parameters import LARGEST, Before, Limit, ModelId, Points, Reading, next_number
from service.http.responses import (
    OPTIONS,
    Format,
    document,
    is_known,
    responses,
    rounded,
    series_json,
    series_lines,
    tag,
    unchanged,
    wants_csv,
    written as answered,
)
from service.models import answers, queries
from service.models.diagnosis_schema import Diagnoses, DiagnosisOut
from service.models.schema import ComparisonOut, ComparisonSeries
from service.version import VERSION

router = APIRouter(tags=["models"])

ComparisonId = Annotated[int, Path(description="Number of the comparison.", ge=1, le=LARGEST, examples=[1])]


@router.get("/comparisons/{comparison_id}", operation_id="get_comparison", **responses(ComparisonOut, 404))
def comparison(request: Request, comparison_id: ComparisonId, sessions: Reading) -> Response:
    """A comparison: errors of force, displacement and floor accelerations."""
    with sessions() as session:
        found = queries.comparison(session, comparison_id)
        return document(request, answers.comparison(found, found.event))


@router.get(
    "/comparisons/{comparison_id}/force",
    operation_id="get_comparison_force",
    **responses(ComparisonSeries, 404, csv=True),
)
def force(
    request: Request, comparison_id: ComparisonId, sessions: Reading, points: Points = None, format: Format = None
) -> Response:
    """Displacement, estimated and modelled force; sample i is at start + i · step unless `time` is given."""
    csv = wants_csv(request, format)
    with sessions() as session:
        found = queries.comparison(session, comparison_id)
        measured = queries.measured(session, found.analysis_id, found.direction)
    etag = tag(VERSION, "comparison", found.id, found.created_at, points, csv)
    if is_known(request, etag):
        return unchanged(etag)
    blobs = {"displacement": measured.displacement, "measured": measured.force, "modelled": found.force}
    series = {name: decode(blob) for name, blob in blobs.items()}
    count = series["modelled"].size
    chosen = kept(series, count, points)
    shown = series if chosen is None else {name: one[chosen] for name, one in series.items()}
    if csv:
        time = (np.arange(count) if chosen is None else chosen) / measured.rate
        lines = {"time": time} | {name: rounded(one) for name, one in shown.items()}
        return answered(request, series_lines(lines), "text/csv", etag)
    content = {
        "comparison": found.id,
        "model": found.model_id,
        "event": found.event_id,
        "direction": found.direction,
        "start": measured.start,
        "rate": measured.rate,
        "step": 1 / measured.rate,
        "count": count,
        "time": None if chosen is None else chosen / measured.rate,
    } | {name: series_json(one) for name, one in shown.items()}
    return answered(request, orjson.dumps(content, option=OPTIONS), "application/json", etag)


DiagnosisId = Annotated[int, Path(description="Number of the diagnosis.", ge=1, le=LARGEST, examples=[1])]


@router.get("/models/{model_id}/diagnoses", operation_id="list_diagnoses", **responses(Diagnoses, 404))
def of_model(
    request: Request, model_id: ModelId, sessions: Reading, cursor: Before = None, limit: Limit = 50
) -> Response:
    """What the model was found to lack, the latest diagnosis first."""
    with sessions() as session:
        queries.version(session, model_id)
        rows = [answers.diagnosis_row(one) for one in queries.diagnoses(session, model_id, cursor, limit)]
    last = next_number([row.id for row in rows], limit)
    return document(request, Diagnoses(items=rows, next=last))


@router.get("/diagnoses/{diagnosis_id}", operation_id="get_diagnosis", **responses(DiagnosisOut, 404))
def diagnosis(request: Request, diagnosis_id: DiagnosisId, sessions: Reading) -> Response:
    """A diagnosis: its outcome, the effects tried, what is open, and what it was made from."""
    with sessions() as session:
        answer = answers.diagnosis(queries.diagnosis(session, diagnosis_id))
    return document(request, answer)
