"""Pages of a building's models and of one model, and the form that makes the first."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from core.effects import EFFECTS
from service.access.auth import Caller, Role, engineer
from service.access.pages import reader
from service.buildings import queries as building_queries
from service.buildings.store import described, zone
from service.db.blobs import decode_history
from service.errors import NotFoundError
from service.http.forms import NOT_REFUSED, Posted, Refused, answered, posted
from service.http.parameters import LARGEST, Code, ModelId, Reading, Writing
from service.http.rendering import page
from service.jobs import requests as job_requests
from service.jobs.queue import UNDER_WAY
from service.jobs.requests import may_cancel
from service.models import answers, queries, requests
from service.models.api.kept_effects import knowing
from service.models.queries import DIRECTIONS
from service.models.schema import ModelRequest, held_out_by
from service.models.tables import ModelComparison, ModelVersion
from service.models.windows import Window, worst_windows

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(knowing(reader))]
By = Annotated[Caller, Depends(knowing(engineer))]
VERSIONS = 200
"""Number of a building's models that its page lists."""
JOBS = 5
"""Jobs and diagnoses of a model that its page lists."""
OFFERED = 50
"""Number of events that a page offers to hold out, the latest first."""
Making = Annotated[Posted[ModelRequest], Depends(posted(ModelRequest))]


@router.get("/buildings/{code}/models")
def of_building(request: Request, code: Code, sessions: Reading, by: Reader) -> Response:
    """The building's models, the latest first."""
    return _listed(request, code, sessions, by)


def _listed(
    request: Request, code: str, sessions: sessionmaker[Session], by: Caller, refused: Refused = NOT_REFUSED
) -> Response:
    """The building's models, with the form to make one if it was refused."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = answers.rows(session, queries.versions(session, building.id, None, None, None, VERSIONS))
        file = described(session, building)
        directions = file.description.horizontal_directions
        return page(
            request,
            "models",
            refused.status,
            refused=refused,
            building=building,
            zone=file.timezone,
            models=rows,
            directions=directions,
            may_work=by.on(code).role >= Role.engineer,
        )


@router.get("/models/{model_id}")
def of_model(
    request: Request,
    model_id: ModelId,
    sessions: Reading,
    by: Reader,
    comparison: Annotated[int | None, Query(ge=1, le=LARGEST)] = None,
    hold_out: Annotated[str | None, Query(pattern=r"^[0-9,]{0,1000}$")] = None,
) -> Response:
    """A model: values, errors, lineage, its loop in one event, and the work that it can be given.

    `hold_out` has the events whose boxes are ticked, where it is given.
    """
    ticked = None if hold_out is None else {int(one) for one in hold_out.split(",") if one}
    return shown_model(request, model_id, sessions, by, comparison, ticked=ticked)


def shown_model(
    request: Request,
    model_id: int,
    sessions: sessionmaker[Session],
    by: Caller,
    comparison: int | None = None,
    refused: Refused = NOT_REFUSED,
    ticked: set[int] | None = None,
) -> Response:
    """A model's page; of a form that was refused it says why, and keeps what was ticked."""
    if refused.of("improve"):
        ticked = held_out_by(refused.given)
    with sessions() as session:
        version = queries.version(session, model_id)
        by = by.on(version.building.code)
        compared = queries.latest_comparisons(session, [model_id])[model_id]
        jobs = job_requests.jobs(session, None, None, model_id, None, JOBS)
        there = queries.latest_comparable(session, version.building_id, DIRECTIONS[version.direction], OFFERED)
        model = answers.whole(session, version)
        shown = _shown([one for one, _ in compared], comparison)
        return page(
            request,
            "model",
            refused.status,
            refused=refused,
            building=version.building,
            zone=zone(session, version.building),
            model=model,
            lineage=answers.rows(session, queries.lineage(session, model_id)),
            comparisons=[answers.comparison_row(*pair) for pair in compared],
            trend=answers.trend(model_id, compared),
            shown=shown,
            windows=[] if shown is None else _windows(session, shown),
            former=queries.former_version(session, version) if version.state == "current" else None,
            jobs=jobs,
            followed=next((job.id for job in jobs if job.state in UNDER_WAY), None),
            ticked=model.held_out if ticked is None else ticked,
            may_cancel=lambda job: may_cancel(job, by),
            offered=there,
            diagnoses=queries.diagnoses(session, model_id, None, JOBS),
            improvement=_improvement(session, version),
            shakes=queries.shakes(session, version.building_id, OFFERED),
            has_spectrum=described(session, version.building).design_spectrum is not None,
            addable=[name for name in EFFECTS if name not in version.effects],
            may_work=by.role >= Role.engineer,
        )


def _shown(compared: list[ModelComparison], number: int | None) -> int | None:
    """The comparison of that number, or that of the strongest force; None without any."""
    if number is None:
        strongest = max(compared, key=lambda one: float(one.misfit["signal"]), default=None)
        return None if strongest is None else strongest.id
    if number not in {one.id for one in compared}:
        raise NotFoundError("comparison of this model", number)
    return number


def _improvement(session: Session, version: ModelVersion) -> int | None:
    """The job that made a version by earthquakes left out; None of another version."""
    if version.parent_id is None:
        return None
    jobs = job_requests.jobs(session, None, None, version.parent_id, None, JOBS)
    made = (job for job in jobs if (job.result or {}).get("made") == version.id)
    return next((job.id for job in made if answers.improvement_steps(job)), None)


def _windows(session: Session, comparison: int) -> list[Window]:
    """The worst parts of a comparison; none where a later analysis left nothing of the measured force."""
    stored = queries.comparison(session, comparison)
    measured = queries.measured(session, stored.analysis_id, stored.direction)
    displacement, force, modelled = map(decode_history, (measured.displacement, measured.force, stored.force))
    return worst_windows(displacement, force, modelled, measured.rate) if force.size == modelled.size else []


@router.post("/buildings/{code}/models")
def make(request: Request, code: Code, sessions: Writing, by: By, form: Making) -> Response:
    """Make the first model of a direction by the design, and show it."""

    def act(wanted: ModelRequest) -> Response:
        with sessions.begin() as session:
            made = requests.make(session, code, wanted, by.name, datetime.now(UTC))
        return RedirectResponse(f"/models/{made.id}", 303)

    return answered("model", form, act, lambda refused: _listed(request, code, sessions, by, refused))
