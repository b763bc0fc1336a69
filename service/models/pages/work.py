"""Forms that begin work on a model, and the pages of jobs; JavaScript shows progress only."""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from service.access.auth import Caller, engineer
from service.access.pages import reader
from service.buildings.store import zone
from service.errors import ConflictError, NotFoundError
from service.http.forms import Posted, Wanted, answered, posted, refused
from service.http.parameters import JobId, ModelId, Reading, Writing
from service.http.rendering import page
from service.jobs import requests as job_requests
from service.jobs.queue import UNDER_WAY, WATCH
from service.jobs.requests import cancel_for, may_cancel
from service.jobs.tables import Job
from service.models import queries, requests, store
from service.models.api.kept_effects import knowing
from service.models.pages.models import shown_model
from service.models.schema import EffectForm, FitForm, SketchForm, held_out_by
from service.records import queries as record_queries

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(knowing(reader))]
By = Annotated[Caller, Depends(knowing(engineer))]


def _form(
    path: str,
    kind: type[Wanted],
    begin: Callable[[Session, int, Wanted, str, datetime], Job | None],
) -> None:
    """Add the form of the model's page that posts to this path.

    It keeps what was ticked, and where the work is refused the page says why. A form of another page has a field
    `follow`: it leads to the page of the job.

    Args:
        path: last part of the address.
        kind: model that checks the form.
        begin: begins the work in a session, on the model of a number; it returns the job, if there is one.
    """

    def work(
        request: Request,
        model_id: ModelId,
        sessions: Writing,
        by: By,
        form: Annotated[Posted[Wanted], Depends(posted(kind))],
    ) -> Response:
        def act(wanted: Wanted) -> Response:
            with sessions.begin() as session:
                job = begin(session, model_id, wanted, by.name, datetime.now(UTC))
                number = None if job is None else job.id
            if "follow" in form.fields and number is not None:
                return RedirectResponse(f"/jobs/{number}", 303)
            hold_out = ",".join(map(str, sorted(held_out_by(form.fields))))
            kept = f"?{urlencode({'hold_out': hold_out})}" if "offered" in form.fields else ""
            return RedirectResponse(f"/models/{model_id}{kept}", 303)

        return answered("improve", form, act, lambda why: shown_model(request, model_id, sessions, by, refused=why))

    router.add_api_route(f"/models/{{model_id}}/{path}", work, methods=["POST"])


def _accept(session: Session, model_id: int, _: FitForm, by: str, now: datetime) -> None:
    store.accept(session, queries.version(session, model_id), by, now)


_form("accept", FitForm, _accept)
_form("compare", FitForm, requests.compare)
_form("fit", FitForm, requests.fit)
_form("diagnose", FitForm, requests.diagnose)
_form("improve", FitForm, requests.improve)
_form("sketch", SketchForm, requests.sketch)
_form("extend", EffectForm, requests.extend)


@router.get("/jobs/{job_id}")
def of_job(request: Request, job_id: JobId, sessions: Reading, by: Reader) -> Response:
    """Progress of work on a model or an earthquake; once it is done, the page of its result."""
    with sessions() as session:
        job = job_requests.job(session, job_id)
        if job.kind == WATCH:
            raise NotFoundError("job that people request", job_id)
        if job.state == "done" and job.refusal is None:
            return RedirectResponse(_result_page(job), 303)
        model = None if job.model_id is None else queries.version(session, job.model_id)
        event = None if job.event_id is None else record_queries.event(session, job.event_id)
        building = job.building or next(one.building for one in (model, event) if one is not None)
        return page(
            request,
            "job",
            job=job,
            building=building,
            zone=zone(session, building),
            model=model,
            event=event,
            is_under_way=job.state in UNDER_WAY,
            may_cancel=may_cancel(job, by),
        )


def _result_page(job: Job) -> str:
    result = job.result or {}
    if "sensors" in result:
        return f"/sensors/{job.id}"
    if job.model_id is None:
        return f"/events/{job.event_id}"
    if "forecast" in result:
        return f"/forecasts/{job.id}"
    if "sketch" in result:
        return f"/sketches/{job.id}"
    if "diagnosis" in result:
        return f"/diagnoses/{result['diagnosis']}"
    return f"/models/{result.get('made', job.model_id)}"


@router.post("/jobs/{job_id}/cancel")
def cancel(request: Request, job_id: JobId, sessions: Writing, by: By) -> Response:
    """Cancel a job, and show what it worked on."""
    with sessions() as session:
        job = job_requests.job(session, job_id)
        model_id, event_id, building = job.model_id, job.event_id, job.building and job.building.code
    try:
        with sessions.begin() as session:
            cancel_for(session, job_id, by, datetime.now(UTC))
    except ConflictError as error:
        if model_id is None:
            raise
        return shown_model(request, model_id, sessions, by, refused=refused("work", {}, error))
    pages = (f"/models/{model_id}", model_id), (f"/events/{event_id}", event_id), (f"/buildings/{building}", building)
    return RedirectResponse(next((path for path, number in pages if number is not None), "/"), 303)
