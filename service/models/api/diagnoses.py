"""What models were found to lack."""

from typing import Annotated

from fastapi import APIRouter, Path, Request, Response

from service.http.parameters import LARGEST, Before, Limit, ModelId, Reading
from service.http.responses import document, responses
from service.models import diagnosis_answers, diagnosis_queries, queries
from service.models.diagnosis_schema import Diagnoses, DiagnosisOut

router = APIRouter(tags=["models"])

DiagnosisId = Annotated[int, Path(description="Number of the diagnosis.", ge=1, le=LARGEST, examples=[1])]


@router.get("/models/{model_id}/diagnoses", operation_id="list_diagnoses", **responses(Diagnoses, 404))
def of_model(
    request: Request, model_id: ModelId, sessions: Reading, cursor: Before = None, limit: Limit = 50
) -> Response:
    """What the model was found to lack, the latest diagnosis first."""
    with sessions() as session:
        queries.version(session, model_id)
        rows = [diagnosis_answers.row(one) for one in diagnosis_queries.diagnoses(session, model_id, cursor, limit)]
    last = str(rows[-1].id) if len(rows) == limit and rows[-1].id > 1 else None
    return document(request, Diagnoses(items=rows, next=last))


@router.get("/diagnoses/{diagnosis_id}", operation_id="get_diagnosis", **responses(DiagnosisOut, 404))
def diagnosis(request: Request, diagnosis_id: DiagnosisId, sessions: Reading) -> Response:
    """A diagnosis: its outcome, the effects tried, what is open, and what it was made from."""
    with sessions() as session:
        answer = diagnosis_answers.whole(diagnosis_queries.diagnosis(session, diagnosis_id))
    return document(request, answer)
