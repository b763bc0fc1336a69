"""Work on models that takes longer than a request: it is queued, and a job tells how far it is."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Response

from service import model_requests
from service.parameters import ModelId, Writing
from service.queries import versions
from service.routers.models import By, making
from service.schemas.models import WorkRequest
from service.schemas.operations import JobOut

router = APIRouter(prefix="/models", tags=["models"])


@router.post(
    "/{model_id}/comparisons",
    operation_id="compare_model",
    status_code=202,
    response_model=JobOut,
    responses=making(202),
)
def compare(
    model_id: ModelId,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[WorkRequest, Body(description="Events; {} for all that can be compared.")],
) -> JobOut:
    """Hold the model against events; its comparisons then have their errors. A like job that waits is answered."""
    with sessions.begin() as session:
        model = versions.version(session, model_id)
        answer = JobOut.model_validate(
            model_requests.compare(session, model, wanted.events, by.name, datetime.now(UTC))
        )
    response.headers["Location"] = f"/api/v1/jobs/{answer.id}"
    return answer
