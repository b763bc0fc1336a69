"""Models of the isolation layer: versions, their values, errors and lineage."""

from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Request, Response

from core.description import BuildingDescription
from core.errors import ModelError
from core.first_model import first_model
from core.isolator import Isolator
from service import model_answers, models
from service.answers import Format, document, responses, table
from service.auth import Caller, engineer
from service.buildings import described
from service.errors import ConflictError, documented
from service.models import Draft
from service.parameters import (
    AnyModelDirection,
    AnyModelState,
    Before,
    Code,
    Cursor,
    Limit,
    ModelId,
    Reading,
    RowLimit,
    Writing,
    place,
)
from service.queries import versions, watched
from service.routers.buildings import following
from service.schemas.models import ComparisonRow, Comparisons, Lineage, ModelOut, ModelRequest, Models

router = APIRouter(tags=["models"])

By = Annotated[Caller, Depends(engineer)]
LOCATION = {"description": "Address of what was made.", "schema": {"type": "string"}}


def making(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """What the OpenAPI document says of the answers of an operation that changes something."""
    return documented(400, 401, 403, 404, 409, 422) | {
        status: {"headers": {"Location": LOCATION}} for status in statuses
    }


@router.get("/buildings/{code}/models", operation_id="list_models", **responses(Models, 404))
def models_of_building(
    request: Request,
    code: Code,
    sessions: Reading,
    direction: AnyModelDirection = None,
    state: AnyModelState = None,
    cursor: Before = None,
    limit: Limit = 50,
) -> Response:
    """Versions of the building's models, the latest first."""
    with sessions() as session:
        found, _ = watched.building(session, code)
        rows = model_answers.rows(session, versions.versions(session, found.id, direction, state, cursor, limit))
    last = str(rows[-1].id) if len(rows) == limit and rows[-1].id > 1 else None
    return document(request, Models(items=rows, next=last))


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

    What is asked must fit the building and the effects there are; else 409 says what would.
    """
    with sessions.begin() as session:
        found, revision = watched.building(session, code)
        isolator, assumed = begun(wanted, described(session, found).description)
        change = wanted.change or ("by the design values" if wanted.effects is None else "by values that were given")
        draft = Draft(wanted.direction, isolator, change, by.name, revision.id, assumed=assumed)
        answer = model_answers.whole(session, models.add(session, found.id, draft, datetime.now(UTC)))
    response.headers["Location"] = f"/api/v1/models/{answer.id}"
    return answer


def begun(wanted: ModelRequest, description: BuildingDescription) -> tuple[Isolator, tuple[str, ...]]:
    """The model that is asked for, and which of its parameters nobody gave or measured.

    Raises:
        ConflictError: the building does not measure that direction, or the values do not fit the effects there are.
    """
    measured = description.horizontal_directions
    if missing := [one for one in models.DIRECTIONS[wanted.direction] if one not in measured]:
        raise ConflictError(
            f"{description.code} does not measure direction {' and '.join(missing)}; it measures {', '.join(measured)}."
        )
    if wanted.effects is None:
        first = first_model(description)
        return first.isolator, first.assumed
    try:
        return Isolator(wanted.effects), ()
    except ModelError as error:
        raise ConflictError(f"The values make no model: {error}.") from None


@router.get("/models/{model_id}", operation_id="get_model", **responses(ModelOut, 404))
def model(request: Request, model_id: ModelId, sessions: Reading) -> Response:
    """A model: its values with standard deviations, what it was made from, its errors."""
    with sessions() as session:
        answer = model_answers.whole(session, versions.version(session, model_id))
    return document(request, answer)


@router.get("/models/{model_id}/lineage", operation_id="get_lineage", **responses(Lineage, 404))
def lineage(request: Request, model_id: ModelId, sessions: Reading) -> Response:
    """A model and all that it came from, each with its errors: what every change gained."""
    with sessions() as session:
        versions.version(session, model_id)
        rows = model_answers.rows(session, versions.lineage(session, model_id))
    return document(request, Lineage(items=rows))


@router.get("/models/{model_id}/comparisons", operation_id="list_comparisons", **responses(Comparisons, 404, csv=True))
def comparisons(
    request: Request,
    model_id: ModelId,
    sessions: Reading,
    cursor: Cursor = None,
    limit: RowLimit = 5000,
    format: Format = None,
) -> Response:
    """The events that the model was held against, a row for each and direction, the earliest event first."""
    with sessions() as session:
        versions.version(session, model_id)
        pairs = versions.comparisons(session, model_id, place(cursor), limit)
        rows = [model_answers.comparison_row(comparison, event) for comparison, event in pairs]
    columns = tuple(ComparisonRow.model_fields)
    last = following([(row.event_start, row.id) for row in rows], limit)
    return table(request, format, columns, [tuple(row.model_dump().values()) for row in rows], last)


@router.post("/models/{model_id}/accept", operation_id="accept_model", response_model=ModelOut, responses=making())
def accept(model_id: ModelId, sessions: Writing, by: By) -> ModelOut:
    """Put the model in force; the one that was for its building and direction retires."""
    with sessions.begin() as session:
        found = versions.version(session, model_id)
        models.accept(session, found, by.name, datetime.now(UTC))
        return model_answers.whole(session, found)
