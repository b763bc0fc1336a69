"""The page of a diagnosis and its pictures; no JavaScript."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response

from service.access.auth import Role, viewer
from service.http.parameters import LARGEST, Reading
from service.http.rendering import page
from service.http.responses import tag, written
from service.models import answers, queries
from service.models.api.comparisons import DiagnosisId
from service.models.pages.models import Reader
from service.version import VERSION

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


@router.get("/charts/model-diagnosis.svg", dependencies=[Depends(viewer)])
def picture(request: Request, sessions: Reading, number: Annotated[int, Query(ge=1, le=LARGEST)]) -> Response:
    """One of its pictures, as the diagnosis drew it."""
    with sessions() as session:
        svg = queries.picture(session, number)
    return written(request, svg.encode(), "image/svg+xml", tag(VERSION, "model-diagnosis", number))
