"""Pages of what work on a model found: a diagnosis, a sketch."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from core.effects import EFFECTS
from core.workbench.texts import distinguishing_records
from service.access.auth import Caller, Role, engineer
from service.access.pages import reader
from service.buildings.store import zone
from service.errors import ConflictError, NotFoundError
from service.http.forms import NOT_REFUSED, Posted, Refused, answered, posted, refused
from service.http.parameters import JobId, Reading, Writing
from service.http.rendering import page
from service.jobs import requests as job_requests
from service.jobs.tables import Job
from service.models import answers, kept_effects, queries, requests, texts
from service.models.api.comparisons import DiagnosisId
from service.models.api.kept_effects import knowing
from service.models.schema import NEW_EFFECT, KeepForm
from service.models.sketch_results import SketchDocument

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(knowing(reader))]
By = Annotated[Caller, Depends(knowing(engineer))]
Keeping = Annotated[Posted[KeepForm], Depends(posted(KeepForm))]


@router.get("/diagnoses/{diagnosis_id}")
def of_diagnosis(request: Request, diagnosis_id: DiagnosisId, sessions: Reading, by: Reader) -> Response:
    """A diagnosis: the text, the effects tried, and the pictures; an engineer may add one of the effects."""
    with sessions() as session:
        stored = queries.diagnosis(session, diagnosis_id)
        (model,) = answers.rows(session, [stored.model])
        found = answers.diagnosis(stored)
        return page(
            request,
            "diagnosis",
            building=stored.model.building,
            zone=zone(session, stored.model.building),
            model=model,
            diagnosis=found,
            sentences=stored.sentences,
            alike=_alike(found.set),
            pictures=stored.pictures,
            may_work=by.on(stored.model.building.code).role >= Role.engineer,
        )


def _alike(effects: Sequence[str]) -> str:
    """Records that would separate effects which a diagnosis cannot distinguish; empty for a single effect."""
    known = [name for name in effects if name in EFFECTS]
    return distinguishing_records(known) if len(known) > 1 else ""


@router.get("/sketches/{job_id}")
def of_sketch(request: Request, job_id: JobId, sessions: Reading, by: Reader) -> Response:
    """A sketch: what is missing, on what it depends, and the law for it."""
    return _shown_sketch(request, job_id, sessions, by)


def _shown_sketch(
    request: Request, job_id: int, sessions: sessionmaker[Session], by: Caller, refused: Refused = NOT_REFUSED
) -> Response:
    with sessions() as session:
        job, found = _sketch(session, job_id)
        (model,) = answers.rows(session, [queries.version(session, job.model_id or 0)])
        building = queries.version(session, model.id).building
        return page(
            request,
            "sketch",
            refused.status,
            refused=refused,
            building=building,
            zone=zone(session, building),
            model=model,
            job=job,
            sketch=found,
            held_out=list(dict.fromkeys(one.earthquake for one in found.course.traces if one.held_out)),
            kept=[one.name for one in kept_effects.rows(session) if one.job_id == job_id],
            may_work=by.on(building.code).role >= Role.engineer,
        )


@router.get("/sketches/{job_id}/effect")
def of_sketched_effect(
    request: Request,
    job_id: JobId,
    sessions: Reading,
    by: Reader,
    name: Annotated[str, Query(max_length=200)] = "",
) -> Response:
    """The file of a sketched effect, under a name of the reader's choice."""
    with sessions() as session:
        _, found = _sketch(session, job_id)
    if found.proposal is None:
        raise NotFoundError("law of sketch", job_id)
    wanted = name.strip() or found.proposal.effect
    try:
        if not re.fullmatch(NEW_EFFECT, wanted):
            raise ConflictError(texts.taken_name(wanted))
        requests.check_new_name(wanted)
    except ConflictError as error:
        return _shown_sketch(request, job_id, sessions, by, refused("effect", {"name": wanted}, error))
    return Response(
        found.proposal.source,
        media_type="text/x-python",
        headers={"Content-Disposition": f'attachment; filename="{wanted}.py"'},
    )


@router.post("/sketches/{job_id}/keep")
def keep(request: Request, job_id: JobId, sessions: Writing, by: By, form: Keeping) -> Response:
    """Keep the law of a sketch as an effect, and show it."""

    def act(wanted: KeepForm) -> Response:
        with sessions.begin() as session:
            made = kept_effects.keep(session, job_id, wanted.name, by.name, datetime.now(UTC))
            return RedirectResponse(f"/effects/{made.name}", 303)

    return answered("effect", form, act, lambda why: _shown_sketch(request, job_id, sessions, by, why))


def _sketch(session: Session, job_id: int) -> tuple[Job, SketchDocument]:
    job = job_requests.job(session, job_id)
    if job.model_id is None or "sketch" not in (job.result or {}):
        raise NotFoundError("sketch", job_id)
    return job, SketchDocument.model_validate((job.result or {})["sketch"])
