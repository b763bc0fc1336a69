"""Comparisons of models with events, their force series, and diagnoses of models."""

from typing import Annotated

from fastapi import APIRouter, Path, Request

from service.db.blobs import decode_history
from service.http.paging import Before, Limit, page_by_number
from service.http.parameters import LARGEST, ModelId, Points, Reading
from service.http.responses import CSV, JSON, Format, Tagged, TaggedRoute, responses, wants_csv
from service.http.series import histories
from service.models import answers, queries
from service.models.schema import ComparisonOut, ComparisonSeries, Diagnoses, DiagnosisOut

router = APIRouter(tags=["models"], route_class=TaggedRoute)

ComparisonId = Annotated[int, Path(description="Number of the comparison.", ge=1, le=LARGEST, examples=[1])]


@router.get("/comparisons/{comparison_id}", operation_id="get_comparison", **responses(ComparisonOut, 404))
def comparison(comparison_id: ComparisonId, sessions: Reading) -> ComparisonOut:
    """A comparison: errors of force, displacement and floor accelerations."""
    with sessions() as session:
        stored = queries.comparison(session, comparison_id)
        return answers.comparison(stored, stored.event)


@router.get(
    "/comparisons/{comparison_id}/force",
    operation_id="get_comparison_force",
    **responses(ComparisonSeries, 404, csv=True),
)
def force(
    request: Request, comparison_id: ComparisonId, sessions: Reading, points: Points = None, format: Format = None
) -> Tagged:
    """Displacement, estimated and modelled force; sample i is at start + i · step unless `time` is given."""
    csv = wants_csv(request, format)
    with sessions() as session:
        stored = queries.comparison(session, comparison_id)
        measured = queries.measured(session, stored.analysis_id, stored.direction)

    def make() -> bytes:
        blobs = {"displacement": measured.displacement, "measured": measured.force, "modelled": stored.force}
        series = {name: decode_history(blob) for name, blob in blobs.items()}
        return histories(series, measured.rate, series["modelled"].size, points).answer(
            ComparisonSeries,
            as_csv=csv,
            comparison=stored.id,
            model=stored.model_id,
            event=stored.event_id,
            direction=stored.direction,
            start=measured.start,
        )

    return Tagged(make, CSV if csv else JSON, "comparison", stored.id, stored.created_at, points)


DiagnosisId = Annotated[int, Path(description="Number of the diagnosis.", ge=1, le=LARGEST, examples=[1])]


@router.get("/models/{model_id}/diagnoses", operation_id="list_diagnoses", **responses(Diagnoses, 404))
def of_model(model_id: ModelId, sessions: Reading, cursor: Before = None, limit: Limit = 50) -> Diagnoses:
    """Diagnoses of the model, the latest first."""
    with sessions() as session:
        queries.version(session, model_id)
        rows = [answers.diagnosis_row(one) for one in queries.diagnoses(session, model_id, cursor, limit)]
    return page_by_number(Diagnoses, rows, limit)


@router.get("/diagnoses/{diagnosis_id}", operation_id="get_diagnosis", **responses(DiagnosisOut, 404))
def diagnosis(diagnosis_id: DiagnosisId, sessions: Reading) -> DiagnosisOut:
    """A diagnosis: its outcome, the effects tried, what is open, and what it was made from."""
    with sessions() as session:
        return answers.diagnosis(queries.diagnosis(session, diagnosis_id))
