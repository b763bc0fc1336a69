"""Models of the isolation layer: versions, values, errors and lineage; and the work on them, which is queued."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Header, Query, Request, Response

from service.access.auth import Caller, engineer
from service.buildings import queries as building_queries
from service.buildings.store import described
from service.http.forms import read_bytes
from service.http.guard import UPLOAD
from service.http.paging import Before, Cursor, Limit, RowLimit, next_place, page_by_number, place
from service.http.parameters import AnyModelDirection, AnyModelState, Code, ModelId, Reading, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, responses, table_responses
from service.jobs.schema import JobOut
from service.jobs.tables import Job
from service.models import answers, queries, requests, store, uploads
from service.models.model_file import written
from service.models.schema import (
    Comparisons,
    EffectRequest,
    FitRequest,
    ForecastRequest,
    ForecastScaling,
    Lineage,
    ModelOut,
    ModelRequest,
    Models,
    SketchRequest,
    Trend,
    WorkRequest,
)
from service.models.uploads import MotionFile
from service.parsing.process import limits

router = APIRouter(tags=["models"], route_class=TaggedRoute)

By = Annotated[Caller, Depends(engineer)]
TOML = "application/toml"
LOCATION = {"description": "Address of what was made.", "schema": {"type": "string"}}


async def body(request: Request) -> bytes:
    """The body of an upload."""
    return await read_bytes(request, UPLOAD)


def making(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """Answers of an operation that changes something, for the OpenAPI document."""
    return openapi_responses(400, 401, 403, 404, 409, 422, 429) | {
        status: {"headers": {"Location": LOCATION}} for status in statuses
    }


@router.get("/buildings/{code}/models", operation_id="list_models", **responses(Models, 404))
def models_of_building(
    code: Code,
    sessions: Reading,
    direction: AnyModelDirection = None,
    state: AnyModelState = None,
    cursor: Before = None,
    limit: Limit = 50,
) -> Models:
    """Versions of the building's models, the latest first."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = answers.rows(session, queries.versions(session, building.id, direction, state, cursor, limit))
    return page_by_number(Models, rows, limit)


@router.post(
    "/buildings/{code}/models",
    operation_id="make_model",
    status_code=201,
    response_model=ModelOut,
    responses=making(201),
)
def make(
    code: Code,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[ModelRequest, Body(description='Direction, and values; {"direction": "x"} for the design\'s.')],
) -> ModelOut:
    """Make a model, a draft as yet: of the values given, or the first one by the building's design values.

    The values must fit the building and the effects there are; otherwise 409 gives the remedy.
    """
    with sessions.begin() as session:
        made = requests.make(session, code, wanted, by.name, datetime.now(UTC))
        answer = answers.whole(session, made)
    response.headers["Location"] = f"/api/v1/models/{answer.id}"
    return answer


@router.get("/models/{model_id}", operation_id="get_model", **responses(ModelOut, 404))
def model(model_id: ModelId, sessions: Reading) -> ModelOut:
    """A model: its values with standard deviations, what it was made from, its errors."""
    with sessions() as session:
        return answers.whole(session, queries.version(session, model_id))


@router.get(
    "/models/{model_id}/file",
    operation_id="get_model_file",
    response_class=Response,
    responses=openapi_responses(401, 403, 404, 409, 422, 429)
    | {200: {"content": {TOML: {"schema": {"type": "string"}}}}},
)
def file(model_id: ModelId, sessions: Reading) -> Response:
    """The model as a file for `menshin model` and notebooks.

    409 if the version names an effect that this Menshin does not have.
    """
    with sessions() as session:
        content = answers.model_file(session, queries.version(session, model_id))
    name = f"{content.building}-{content.direction}-{model_id}.toml"
    return Response(
        written(content).encode(), media_type=TOML, headers={"Content-Disposition": f'attachment; filename="{name}"'}
    )


@router.get("/models/{model_id}/lineage", operation_id="get_lineage", **responses(Lineage, 404))
def lineage(model_id: ModelId, sessions: Reading) -> Lineage:
    """A model and all that it came from, each with its errors: what every change gained."""
    with sessions() as session:
        queries.version(session, model_id)
        return Lineage(items=answers.rows(session, queries.lineage(session, model_id)))


@router.get("/models/{model_id}/comparisons", operation_id="list_comparisons", **table_responses(Comparisons, 404))
def comparisons(model_id: ModelId, sessions: Reading, cursor: Cursor = None, limit: RowLimit = 5000) -> Comparisons:
    """The events that the model was compared with, a row for each and direction, the earliest event first."""
    with sessions() as session:
        queries.version(session, model_id)
        pairs = queries.comparisons(session, model_id, place(cursor), limit)
        rows = [answers.comparison_row(comparison, event) for comparison, event in pairs]
    return Comparisons(items=rows, next=next_place([(row.event_start, row.id) for row in rows], limit))


@router.get("/models/{model_id}/trend", operation_id="get_model_trend", **responses(Trend, 404))
def trend(model_id: ModelId, sessions: Reading) -> Trend:
    """Errors of the model in every compared event, and whether the model is still valid.

    The current model is compared with every new event. It misses an event if the share of the force that
    neither the model nor noise explains exceeds 1.5 times the largest in the events it was fitted to, and 2 %, and the
    noise ratio exceeds 1.25.
    A model that misses two events in a row is no longer valid.
    """
    with sessions() as session:
        queries.version(session, model_id)
        compared = queries.latest_comparisons(session, [model_id])[model_id]
    return answers.trend(model_id, compared)


@router.post("/models/{model_id}/accept", operation_id="accept_model", response_model=ModelOut, responses=making())
def accept(model_id: ModelId, sessions: Writing, by: By) -> ModelOut:
    """Put the current model; the one that was for its building and direction retires."""
    with sessions.begin() as session:
        version = queries.version(session, model_id)
        store.accept(session, version, by.name, datetime.now(UTC))
        return answers.whole(session, version)


FittingWanted = Annotated[
    FitRequest, Body(description="Events to fit to and events to hold out; {} to fit to all that can be compared.")
]


@router.post(
    "/models/{model_id}/comparisons",
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
        return _queued(requests.compare(session, model_id, wanted, by.name, datetime.now(UTC)), response)


@router.post(
    "/models/{model_id}/fits", operation_id="fit_model", status_code=202, response_model=JobOut, responses=making(202)
)
def fit(model_id: ModelId, sessions: Writing, response: Response, by: By, wanted: FittingWanted) -> JobOut:
    """Fit the model's values to events: its next version, a draft, with their standard deviations and its errors.

    The job's `result` has the number of the version `made`, and all numbers of the `fit`.
    """
    with sessions.begin() as session:
        return _queued(requests.fit(session, model_id, wanted, by.name, datetime.now(UTC)), response)


@router.post(
    "/models/{model_id}/effects",
    operation_id="add_effect",
    status_code=202,
    response_model=JobOut,
    responses=making(202),
)
def extend(
    model_id: ModelId,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[EffectRequest, Body(description="Effect, events to fit to and events to hold out.")],
) -> JobOut:
    """Add an effect and fit everything anew: the model's next version, a draft, with its errors.

    It is added whether the events support it or not. The job's `result` has the number of the version `made`, and of
    the `fit` the errors before and after, on events fitted and held out, and in words whether they support it.
    """
    with sessions.begin() as session:
        return _queued(requests.extend(session, model_id, wanted, by.name, datetime.now(UTC)), response)


@router.post(
    "/models/{model_id}/improvements",
    operation_id="improve_model",
    status_code=202,
    response_model=JobOut,
    responses=making(202),
)
def improve(model_id: ModelId, sessions: Writing, response: Response, by: By, wanted: FittingWanted) -> JobOut:
    """Diagnose the model and add what it lacks, by turns: its next version, a draft, with its errors.

    Where something unknown is missing, stronger events are predicted by weaker ones, and effects are added as long as
    this becomes better; that takes minutes. The job's `result` has the number of the version `made`, and of the `fit`
    the effects `taken`, the errors in events `left_out` after each change, how much a prediction may err `beyond` the
    range of the events, and all of it in words.
    """
    with sessions.begin() as session:
        return _queued(requests.improve(session, model_id, wanted, by.name, datetime.now(UTC)), response)


@router.post(
    "/models/{model_id}/diagnoses",
    operation_id="diagnose_model",
    status_code=202,
    response_model=JobOut,
    responses=making(202),
)
def diagnose(model_id: ModelId, sessions: Writing, response: Response, by: By, wanted: FittingWanted) -> JobOut:
    """Find which physical effect the model lacks, or that none is missing, or that no known effect explains it.

    The job's `result` has the number of the `diagnosis`. Nothing is changed: adding an effect is a separate request.
    """
    with sessions.begin() as session:
        return _queued(requests.diagnose(session, model_id, wanted, by.name, datetime.now(UTC)), response)


@router.post(
    "/models/{model_id}/sketches",
    operation_id="sketch_missing_force",
    status_code=202,
    response_model=JobOut,
    responses=making(202),
)
def sketch(
    model_id: ModelId,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[SketchRequest, Body(description="Events, events to hold out, and a name; {} for all events.")],
) -> JobOut:
    """Sketch the force that the model lacks, where no effect explains it.

    The job's `result` has the `sketch`: the missing force with its deviation, what it depends on, and the simplest law
    that lowers the error where nothing was fitted, as a formula and as the file of an effect; `proposal` is null where
    no law does. `GET /api/v1/jobs/{job_id}` gives it. Nothing is changed.
    """
    with sessions.begin() as session:
        return _queued(requests.sketch(session, model_id, wanted, by.name, datetime.now(UTC)), response)


@router.post(
    "/models/{model_id}/forecasts",
    operation_id="forecast_model",
    status_code=202,
    response_model=JobOut,
    responses=making(202),
)
def forecast(
    model_id: ModelId,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[ForecastRequest, Body(description="An earthquake, and what it is scaled to.")],
) -> JobOut:
    """Forecast the response to the ground motion of a stored earthquake, as if it came now.

    The job's `result` has the `forecast`: peaks with 95 % intervals, the building's limits, and whether the motion
    leaves the range that the model has seen. `GET /api/v1/jobs/{job_id}` gives it.
    """
    with sessions.begin() as session:
        return _queued(requests.forecast(session, model_id, wanted, by.name, datetime.now(UTC)), response)


@router.post(
    "/models/{model_id}/forecasts/uploaded",
    operation_id="forecast_uploaded_motion",
    status_code=202,
    response_model=JobOut,
    responses=making(202),
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
        }
    },
)
def forecast_uploaded(
    request: Request,
    model_id: ModelId,
    sessions: Writing,
    response: Response,
    by: By,
    data: Annotated[bytes, Depends(body)],
    wanted: Annotated[ForecastScaling, Query()],
    name: Annotated[str, Header(alias="X-File-Name", description="Name of the file.", max_length=100)] = "motion",
) -> JobOut:
    """Forecast the response to the ground motion of a file, as if it came now.

    The body is a file of any format that Menshin reads, or a ZIP archive of several, such as one for each component; 16
    MiB at most. Of the building's own records the ground's accelerations are taken, of others every acceleration, by
    the last letter of its channel code. 409 gives the reason why a file cannot be used.
    """
    file = MotionFile(name, data)
    with sessions() as session:
        building = described(session, queries.version(session, model_id).building)
    uploads.check(file, building, limits(request.app.state.settings))
    kept = uploads.kept(file, request.app.state.settings)
    with sessions.begin() as session:
        return _queued(
            requests.forecast_uploaded(session, model_id, kept, wanted, by.name, datetime.now(UTC)), response
        )


def _queued(job: Job, response: Response) -> JobOut:
    """The job, and where to look for its end."""
    response.headers["Location"] = f"/api/v1/jobs/{job.id}"
    return JobOut.model_validate(job)
