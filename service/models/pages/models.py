"""The pages of the models and of the physical effects, and their forms; JavaScript shows progress only."""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from core.effects import EFFECTS
from service.access.auth import Caller, Role, engineer
from service.access.pages import reader
from service.buildings import queries as building_queries
from service.buildings.store import described
from service.errors import ConflictError, FieldsError, NotFoundError
from service.http.forms import NOT_REFUSED, Form, Refused, taken
from service.http.parameters import LARGEST, Code, JobId, ModelId, Reading, Writing
from service.http.rendering import page
from service.jobs import queries as job_queries
from service.jobs.api import cancelled, may_cancel
from service.jobs.queue import UNDER_WAY
from service.models import answers, queries, queries as model_queries, requests, versions as model_versions
from service.models.api.effects import EffectName, answered
from service.models.tables import ModelComparison, ModelVersion
from service.models.workbench.effect_sheets import families

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(reader)]
By = Annotated[Caller, Depends(engineer)]
VERSIONS = 200
"""Of a building's models that its page lists."""
JOBS = 5
"""Of a model that its page lists."""
OFFERED = 50
"""Events that a page offers to leave out, the latest first."""
HOLD_OUT = "hold_out_"
"""Begins the names of a form's boxes for the events to leave out."""


@router.get("/buildings/{code}/models")
def of_building(request: Request, code: Code, sessions: Reading, by: Reader) -> Response:
    """The building's models, the latest first."""
    return _listed(request, code, sessions, by)


def _listed(
    request: Request, code: str, sessions: sessionmaker[Session], by: Caller, refused: Refused = NOT_REFUSED
) -> Response:
    """The building's models, with the form to make one if it was refused."""
    with sessions() as session:
        found, _ = building_queries.building(session, code)
        rows = answers.rows(session, queries.versions(session, found.id, None, None, None, VERSIONS))
        directions = described(session, found).description.horizontal_directions
        return page(
            request,
            "models",
            refused.status,
            refused=refused,
            building=found,
            models=rows,
            directions=directions,
            may_work=by.role >= Role.engineer,
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
    """A model: values, errors, lineage, its loop in one event, and what can be asked of it.

    `hold_out` has the events whose boxes are ticked, where it is given.
    """
    ticked = None if hold_out is None else {int(one) for one in hold_out.split(",") if one}
    return _shown_model(request, model_id, sessions, by, comparison, ticked=ticked)


def _shown_model(
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
        ticked = _ticked(refused.given)
    with sessions() as session:
        found = queries.version(session, model_id)
        compared = queries.latest_comparisons(session, [model_id])[model_id]
        jobs = job_queries.jobs(session, None, None, model_id, None, JOBS)
        there = queries.comparable(session, found.building_id, model_versions.DIRECTIONS[found.direction], None)
        model = answers.whole(session, found)
        return page(
            request,
            "model",
            refused.status,
            refused=refused,
            building=found.building,
            model=model,
            lineage=answers.rows(session, queries.lineage(session, model_id)),
            comparisons=[answers.comparison_row(*pair) for pair in compared],
            trend=answers.trend(model_id, compared),
            shown=_shown([one for one, _ in compared], comparison),
            jobs=jobs,
            followed=next((job.id for job in jobs if job.state in UNDER_WAY), None),
            ticked=model.left_out if ticked is None else ticked,
            may_cancel=lambda job: may_cancel(job, by),
            offered=there[: -OFFERED - 1 : -1],
            diagnoses=model_queries.diagnoses(session, model_id, None, JOBS),
            addable=[name for name in EFFECTS if name not in found.effects],
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


@router.get("/effects")
def effects(request: Request, _: Reader) -> Response:
    """The physical effects that a model may have."""
    return page(request, "effects", families=families(EFFECTS), effects=EFFECTS)


@router.get("/effects/{name}")
def effect(request: Request, name: EffectName, _: Reader) -> Response:
    """One of them, explained."""
    if name not in EFFECTS:
        raise NotFoundError("effect", name)
    return page(request, "effect", effect=answered(name, EFFECTS[name]))


@router.post("/buildings/{code}/models")
def make(request: Request, code: Code, sessions: Writing, by: By, form: Form) -> Response:
    """Make the first model of a direction by the design, and show it."""
    direction = form.get("direction", "")

    def act() -> Response:
        if direction not in model_versions.DIRECTIONS:
            raise FieldsError({"direction": f"there is no direction {direction!r}; choose x, y or xy"})
        with sessions.begin() as session:
            made = requests.make(session, code, direction, None, "", by.name, datetime.now(UTC))
        return RedirectResponse(f"/models/{made.id}", 303)

    return taken("model", form, act, lambda refused: _listed(request, code, sessions, by, refused))


@router.post("/models/{model_id}/accept")
def accept(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Form) -> Response:
    """Put the model in force, and show it."""

    def ask(session: Session, model: ModelVersion) -> None:
        model_versions.accept(session, model, by.name, datetime.now(UTC))

    return _asked(request, model_id, sessions, by, form, ask)


@router.post("/models/{model_id}/compare")
def compare(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Form) -> Response:
    """Hold the model against every event, and show how far that is."""

    def ask(session: Session, model: ModelVersion) -> None:
        requests.compare(session, model, None, by.name, datetime.now(UTC))

    return _asked(request, model_id, sessions, by, form, ask)


@router.post("/models/{model_id}/fit")
def fit(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Form) -> Response:
    """Fit the model to the events but those left out, and show how far that is."""

    def ask(session: Session, model: ModelVersion) -> None:
        requests.fit(session, model, *_events(form), by.name, datetime.now(UTC))

    return _asked(request, model_id, sessions, by, form, ask)


@router.post("/models/{model_id}/diagnose")
def diagnose(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Form) -> Response:
    """Ask what the model lacks by the events but those left out, and show how far that is."""

    def ask(session: Session, model: ModelVersion) -> None:
        requests.diagnose(session, model, *_events(form), by.name, datetime.now(UTC))

    return _asked(request, model_id, sessions, by, form, ask)


@router.post("/models/{model_id}/extend")
def extend(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Form) -> Response:
    """Add an effect to the model, and show how far that is."""

    def ask(session: Session, model: ModelVersion) -> None:
        effect = form.get("effect", "")
        requests.extend(session, model, effect, *_events(form), by.name, datetime.now(UTC))

    return _asked(request, model_id, sessions, by, form, ask)


@router.post("/jobs/{job_id}/cancel")
def cancel(request: Request, job_id: JobId, sessions: Writing, by: By, form: Form) -> Response:
    """Cancel a job, and show what it worked on."""
    with sessions() as session:
        job = job_queries.job(session, job_id)
        model_id, event_id = job.model_id, job.event_id

    def act() -> Response:
        with sessions.begin() as session:
            cancelled(session, job_queries.job(session, job_id), by)
        found = (f"/models/{model_id}", model_id), (f"/events/{event_id}", event_id)
        return RedirectResponse(next((path for path, number in found if number is not None), "/"), 303)

    if model_id is None:
        return act()
    return taken("work", form, act, lambda refused: _shown_model(request, model_id, sessions, by, refused=refused))


def _asked(
    request: Request,
    model_id: int,
    sessions: sessionmaker[Session],
    by: Caller,
    form: Mapping[str, str],
    ask: Callable[[Session, ModelVersion], None],
) -> Response:
    """Do something with a model; the form keeps what was ticked, and where that is refused the page says why."""

    def act() -> Response:
        with sessions.begin() as session:
            ask(session, queries.version(session, model_id))
        kept = urlencode({"hold_out": ",".join(map(str, sorted(_ticked(form))))}) if "offered" in form else ""
        return RedirectResponse(f"/models/{model_id}{'?' if kept else ''}{kept}", 303)

    return taken("improve", form, act, lambda refused: _shown_model(request, model_id, sessions, by, refused=refused))


def _ticked(form: Mapping[str, str]) -> set[int]:
    """The events that a form leaves out, as far as it names any."""
    names = (name.removeprefix(HOLD_OUT) for name in form if name.startswith(HOLD_OUT))
    return {int(name) for name in names if name.isascii() and name.isdigit()}


def _events(form: Mapping[str, str]) -> tuple[list[int] | None, list[int] | None]:
    """Events to fit to and to leave out, of a form whose fields are named `event_1` and `hold_out_2`."""
    return _numbers(form, "event_"), _numbers(form, HOLD_OUT)


def _numbers(form: Mapping[str, str], prefix: str) -> list[int] | None:
    written = [name.removeprefix(prefix) for name in form if name.startswith(prefix)]
    if strange := [one for one in written if not (one.isascii() and one.isdigit() and len(one) < 10)]:
        raise ConflictError(f"There is no event {strange[0]!r}; its number would do.")
    return [int(one) for one in written] or None
