"""Pages of models, diagnoses, sketches and physical effects, and their forms; JavaScript shows progress only."""

import re
from collections.abc import Callable, Mapping, Sequence
from datetime import UTC, datetime
from typing import Annotated
from urllib.parse import urlencode

from fastapi import APIRouter, Depends, Query, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from core.effect import PLACE
from core.effects import EFFECTS
from core.units import shown
from core.workbench.texts import distinguishing_records
from service.access.auth import Caller, Role, engineer
from service.access.pages import reader
from service.buildings import queries as building_queries
from service.buildings.store import described, zone
from service.db.blobs import decode_history
from service.errors import ConflictError, FieldsError, NotFoundError
from service.http.forms import NOT_REFUSED, Posted, Refused, Wanted, answered, posted, refused, ticked
from service.http.parameters import LARGEST, Code, JobId, ModelId, Reading, Writing
from service.http.rendering import page
from service.jobs import requests as job_requests
from service.jobs.queue import UNDER_WAY
from service.jobs.requests import cancel_for, may_cancel
from service.jobs.tables import Job
from service.language.translation import said
from service.models import answers, queries, requests, store, texts
from service.models.api.comparisons import DiagnosisId
from service.models.api.effects import EffectName, answered as effect_out
from service.models.effect_loops import AMPLITUDE, read_values, slider, usual_values
from service.models.effects import families
from service.models.forecast_results import ForecastDocument
from service.models.forecast_words import limit_row, peak_row
from service.models.queries import DIRECTIONS
from service.models.schema import HOLD_OUT, NEW_EFFECT, EffectForm, FitForm, ForecastForm, ModelRequest, SketchForm
from service.models.sketch_results import SketchDocument
from service.models.tables import ModelComparison
from service.models.windows import Window, worst_windows
from service.records import queries as record_queries

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(reader)]
By = Annotated[Caller, Depends(engineer)]
VERSIONS = 200
"""Number of a building's models that its page lists."""
JOBS = 5
"""Jobs and diagnoses of a model that its page lists."""
OFFERED = 50
"""Number of events that a page offers to hold out, the latest first."""
Making = Annotated[Posted[ModelRequest], Depends(posted(ModelRequest))]
Fitting = Annotated[Posted[FitForm], Depends(posted(FitForm))]
Forecasting = Annotated[Posted[ForecastForm], Depends(posted(ForecastForm))]
Sketching = Annotated[Posted[SketchForm], Depends(posted(SketchForm))]
Extending = Annotated[Posted[EffectForm], Depends(posted(EffectForm))]


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
            ticked=model.left_out if ticked is None else ticked,
            may_cancel=lambda job: may_cancel(job, by),
            offered=there,
            diagnoses=queries.diagnoses(session, model_id, None, JOBS),
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


def _windows(session: Session, comparison: int) -> list[Window]:
    """The worst parts of a comparison; none where a later analysis left nothing of the measured force."""
    stored = queries.comparison(session, comparison)
    measured = queries.measured(session, stored.analysis_id, stored.direction)
    displacement, force, modelled = map(decode_history, (measured.displacement, measured.force, stored.force))
    return worst_windows(displacement, force, modelled, measured.rate) if force.size == modelled.size else []


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


@router.get("/forecasts/{job_id}")
def of_forecast(request: Request, job_id: JobId, sessions: Reading, by: Reader) -> Response:
    """A forecast: warnings, the building's limits, and the response with its intervals."""
    with sessions() as session:
        job, found = _forecast(session, job_id)
        (model,) = answers.rows(session, [queries.version(session, job.model_id or 0)])
        building = queries.version(session, model.id).building
        return page(
            request,
            "forecast",
            building=building,
            zone=zone(session, building),
            model=model,
            job=job,
            found=found,
            forecast=found.forecasts[0],
            shown_limits=[limit_row(one) for one in found.forecasts[0].limits],
            shown_peaks=[peak_row(one) for one in found.forecasts[0].peaks],
        )


def _forecast(session: Session, job_id: int) -> tuple[Job, ForecastDocument]:
    job = job_requests.job(session, job_id)
    if job.model_id is None or "forecast" not in (job.result or {}):
        raise NotFoundError("forecast", job_id)
    return job, ForecastDocument.model_validate((job.result or {})["forecast"])


@router.get("/sketches/{job_id}")
def of_sketch(request: Request, job_id: JobId, sessions: Reading, by: Reader) -> Response:
    """A sketch: what is missing, on what it depends, and the law for it."""
    return _shown_sketch(request, job_id, sessions)


def _shown_sketch(
    request: Request, job_id: int, sessions: sessionmaker[Session], refused: Refused = NOT_REFUSED
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
            held_out=list(dict.fromkeys(one.earthquake for one in found.course.traces if one.left_out)),
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
        return _shown_sketch(request, job_id, sessions, refused("effect", {"name": wanted}, error))
    return Response(
        found.proposal.source,
        media_type="text/x-python",
        headers={"Content-Disposition": f'attachment; filename="{wanted}.py"'},
    )


def _sketch(session: Session, job_id: int) -> tuple[Job, SketchDocument]:
    job = job_requests.job(session, job_id)
    if job.model_id is None or "sketch" not in (job.result or {}):
        raise NotFoundError("sketch", job_id)
    return job, SketchDocument.model_validate((job.result or {})["sketch"])


@router.get("/jobs/{job_id}")
def of_job(request: Request, job_id: JobId, sessions: Reading, by: Reader) -> Response:
    """Progress of work on a model or an earthquake; once it is done, the page of its result."""
    with sessions() as session:
        job = job_requests.job(session, job_id)
        if job.model_id is None and job.event_id is None:
            raise NotFoundError("job on a model or an earthquake", job_id)
        if job.state == "done" and job.refusal is None:
            return RedirectResponse(_result_page(job), 303)
        model = None if job.model_id is None else queries.version(session, job.model_id)
        event = None if job.event_id is None else record_queries.event(session, job.event_id)
        building = next(one.building for one in (model, event) if one is not None)
        return page(
            request,
            "job",
            job=job,
            zone=zone(session, building),
            model=model,
            event=event,
            is_under_way=job.state in UNDER_WAY,
            may_cancel=may_cancel(job, by),
        )


def _result_page(job: Job) -> str:
    result = job.result or {}
    if job.model_id is None:
        return f"/events/{job.event_id}"
    if "forecast" in result:
        return f"/forecasts/{job.id}"
    if "sketch" in result:
        return f"/sketches/{job.id}"
    if "diagnosis" in result:
        return f"/diagnoses/{result['diagnosis']}"
    return f"/models/{result.get('made', job.model_id)}"


@router.get("/effects")
def effects(request: Request, _: Reader) -> Response:
    """The physical effects that a model may have."""
    return page(request, "effects", families=families(EFFECTS), effects=EFFECTS)


@router.get("/effects/{name}")
def effect(request: Request, name: EffectName, _: Reader) -> Response:
    """One of them, explained, with its loop at the values of the query."""
    if name not in EFFECTS:
        raise NotFoundError("effect", name)
    refusal, typed = NOT_REFUSED, dict(request.query_params)
    try:
        values, amplitude = read_values(name, typed)
    except FieldsError as error:
        refusal = refused("values", typed, error)
        values, amplitude = usual_values(name), AMPLITUDE
    parameters = EFFECTS[name].parameters
    return page(
        request,
        "effect",
        refusal.status,
        refused=refusal,
        effect=effect_out(name, EFFECTS[name]),
        explanation=_explanation(name),
        sliders={one.name: slider(one) for one in parameters},
        typed={one.name: f"{shown(values[one.name], one.unit):.6g}" for one in parameters}
        | {"amplitude": f"{amplitude * 1e3:g}"},
    )


def _explanation(name: str) -> str:
    """Explanation of an effect with the names of its parameters, which are not translated."""
    return PLACE.sub(r"\1", said(PLACE.sub(r"{\1}", EFFECTS[name].explanation)))


@router.post("/buildings/{code}/models")
def make(request: Request, code: Code, sessions: Writing, by: By, form: Making) -> Response:
    """Make the first model of a direction by the design, and show it."""

    def act(wanted: ModelRequest) -> Response:
        with sessions.begin() as session:
            made = requests.make(session, code, wanted, by.name, datetime.now(UTC))
        return RedirectResponse(f"/models/{made.id}", 303)

    return answered("model", form, act, lambda refused: _listed(request, code, sessions, by, refused))


@router.post("/models/{model_id}/accept")
def accept(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Fitting) -> Response:
    """Put the current model, and show it."""

    def work(session: Session, _: FitForm, now: datetime) -> None:
        store.accept(session, queries.version(session, model_id), by.name, now)

    return _worked(request, model_id, sessions, by, form, work)


@router.post("/models/{model_id}/compare")
def compare(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Fitting) -> Response:
    """Compare the model with every event, and show the progress."""

    def work(session: Session, wanted: FitForm, now: datetime) -> Job:
        return requests.compare(session, model_id, wanted, by.name, now)

    return _worked(request, model_id, sessions, by, form, work)


@router.post("/models/{model_id}/fit")
def fit(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Fitting) -> Response:
    """Fit the model to all events except the held-out ones, and show the progress."""

    def work(session: Session, wanted: FitForm, now: datetime) -> Job:
        return requests.fit(session, model_id, wanted, by.name, now)

    return _worked(request, model_id, sessions, by, form, work)


@router.post("/models/{model_id}/diagnose")
def diagnose(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Fitting) -> Response:
    """Diagnose the model by all events except the held-out ones, and show the progress."""

    def work(session: Session, wanted: FitForm, now: datetime) -> Job:
        return requests.diagnose(session, model_id, wanted, by.name, now)

    return _worked(request, model_id, sessions, by, form, work)


@router.post("/models/{model_id}/improve")
def improve(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Fitting) -> Response:
    """Diagnose the model and add what it lacks, by turns, by all events except the held-out ones."""

    def work(session: Session, wanted: FitForm, now: datetime) -> Job:
        return requests.improve(session, model_id, wanted, by.name, now)

    return _worked(request, model_id, sessions, by, form, work)


@router.post("/models/{model_id}/sketch")
def sketch(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Sketching) -> Response:
    """Sketch what the model lacks in all events except the held-out ones, and show the progress."""

    def work(session: Session, wanted: SketchForm, now: datetime) -> Job:
        return requests.sketch(session, model_id, wanted, by.name, now)

    return _worked(request, model_id, sessions, by, form, work)


@router.post("/models/{model_id}/forecast")
def forecast(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Forecasting) -> Response:
    """Forecast the response to a stored earthquake, and show the progress."""

    def act(wanted: ForecastForm) -> Response:
        with sessions.begin() as session:
            number = requests.forecast(session, model_id, wanted.request, by.name, datetime.now(UTC)).id
        return RedirectResponse(f"/jobs/{number}", 303)

    return answered("forecast", form, act, lambda why: _shown_model(request, model_id, sessions, by, refused=why))


@router.post("/models/{model_id}/extend")
def extend(request: Request, model_id: ModelId, sessions: Writing, by: By, form: Extending) -> Response:
    """Add an effect to the model, and show the progress."""

    def work(session: Session, wanted: EffectForm, now: datetime) -> Job:
        return requests.extend(session, model_id, wanted, by.name, now)

    return _worked(request, model_id, sessions, by, form, work)


@router.post("/jobs/{job_id}/cancel")
def cancel(request: Request, job_id: JobId, sessions: Writing, by: By) -> Response:
    """Cancel a job, and show what it worked on."""
    with sessions() as session:
        job = job_requests.job(session, job_id)
        model_id, event_id = job.model_id, job.event_id
    try:
        with sessions.begin() as session:
            cancel_for(session, job_id, by, datetime.now(UTC))
    except ConflictError as error:
        if model_id is None:
            raise
        return _shown_model(request, model_id, sessions, by, refused=refused("work", {}, error))
    pages = (f"/models/{model_id}", model_id), (f"/events/{event_id}", event_id)
    return RedirectResponse(next((path for path, number in pages if number is not None), "/"), 303)


def _worked(
    request: Request,
    model_id: int,
    sessions: sessionmaker[Session],
    by: Caller,
    form: Posted[Wanted],
    work: Callable[[Session, Wanted, datetime], Job | None],
) -> Response:
    """Work on a model; the form keeps what was ticked, and where the work is refused the page says why.

    A form of another page has a field `follow`: it leads to the page of the job.
    """

    def act(wanted: Wanted) -> Response:
        with sessions.begin() as session:
            job = work(session, wanted, datetime.now(UTC))
            number = None if job is None else job.id
        if "follow" in form.fields and number is not None:
            return RedirectResponse(f"/jobs/{number}", 303)
        hold_out = ",".join(map(str, sorted(_ticked(form.fields))))
        kept = f"?{urlencode({'hold_out': hold_out})}" if "offered" in form.fields else ""
        return RedirectResponse(f"/models/{model_id}{kept}", 303)

    return answered("improve", form, act, lambda why: _shown_model(request, model_id, sessions, by, refused=why))


def _ticked(fields: Mapping[str, str]) -> set[int]:
    """The events that a form holds out, if any."""
    return {int(one) for one in ticked(fields, HOLD_OUT) if one.isascii() and one.isdigit()}
