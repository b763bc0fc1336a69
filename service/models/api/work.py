"""Work on models that takes longer than a request: it is queued, and a job tells how far it is."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Response

from service.http.parameters import ModelId, Writing
from service.jobs.schema import JobOut
from service.jobs.tables import Job
from service.models import queries, requests
from service.models.api.models import By, making
from service.models.schema import EffectRequest, FitRequest, WorkRequest

router = APIRouter(prefix="/models", tags=["models"])

FittingWanted = Annotated[
    FitRequest, Body(description="Events to fit to and events to hold out; {} to fit to all that can be compared.")
]


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
        model = queries.version(session, model_id)
        job = requests.compare(session, model, wanted.events, by.name, datetime.now(UTC))
        return _queued(job, response)


@router.post(
    "/{model_id}/fits", operation_id="fit_model", status_code=202, response_model=JobOut, responses=making(202)
)
def fit(model_id: ModelId, sessions: Writing, response: Response, by: By, wanted: FittingWanted) -> JobOut:
    """Fit the model's values to events: its next version, a draft, with their standard deviations and its errors.

    The job's `result` has the number of the version `made`, and all numbers of the `fit`.
    """
    with sessions.begin() as session:
        model = queries.version(session, model_id)
        job = requests.fit(session, model, wanted.events, wanted.hold_out, by.name, datetime.now(UTC))
        return _queued(job, response)


@router.post(
    "/{model_id}/effects", operation_id="add_effect", status_code=202, response_model=JobOut, responses=making(202)
)
def extend(
    model_id: ModelId,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[EffectRequest, Body(description="Effect, events to fit to and events to hold out.")],
) -> JobOut:
    """Add an effect and fit everything anew: the model's next version, a draft, with its errors.

    It is added whether the events ask for it or not. The job's `result` has the number of the version `made`, and of
    the `fit` the errors before and after, on events fitted and held out, and in words whether it was asked for.
    """
    with sessions.begin() as session:
        model = queries.version(session, model_id)
        by_name, now = by.name, datetime.now(UTC)
        job = requests.extend(session, model, wanted.effect, wanted.events, wanted.hold_out, by_name, now)
        return _queued(job, response)


@router.post(
    "/{model_id}/diagnoses",
    operation_id="diagnose_model",
    status_code=202,
    response_model=JobOut,
    responses=making(202),
)
def diagnose(model_id: ModelId, sessions: Writing, response: Response, by: By, wanted: FittingWanted) -> JobOut:
    """Ask which physical effect the model lacks, or whether none is missing, or none that is known would do.

    The job's `result` has the number of the `diagnosis`. Nothing is changed: to add an effect is another wish.
    """
    with sessions.begin() as session:
        model = queries.version(session, model_id)
        job = requests.diagnose(session, model, wanted.events, wanted.hold_out, by.name, datetime.now(UTC))
        return _queued(job, response)


def _queued(job: Job, response: Response) -> JobOut:
    """The job, and where to look for its end."""
    response.headers["Location"] = f"/api/v1/jobs/{job.id}"
    return JobOut.model_validate(job)
