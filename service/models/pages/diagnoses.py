"""The page of a diagnosis; no JavaScript."""

from fastapi import APIRouter, Request, Response

from service.access.auth import Role
from service.http.parameters import Reading
from service.http.rendering import page
from service.models import answers, queries
from service.models.api.comparisons import DiagnosisId
from service.models.pages.models import Reader

router = APIRouter(include_in_schema=False)


@router.get("/diagnoses/{diagnosis_id}")
def of_diagnosis(request: Request, diagnosis_id: DiagnosisId, sessions: Reading, by: Reader) -> Response:
    """What a model lacks: the text, the effects tried, and the pictures; an engineer may add one of them."""
    with sessions() as session:
        found = queries.diagnosis(session, diagnosis_id)
        (model,) = answers.rows(session, [found.model])
        return page(
            request,
            "diagnosis",
            building=found.model.building,
            model=model,
            diagnosis=answers.diagnosis(found),
            sentences=found.sentences,
            pictures=found.pictures,
            may_work=by.role >= Role.engineer,
        )
