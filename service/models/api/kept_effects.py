"""Sketched laws that are kept as effects: listed, made, downloaded, deleted."""

from collections.abc import Awaitable, Callable, Coroutine, Sequence
from datetime import UTC, datetime
from typing import Annotated, Any

from fastapi import APIRouter, Body, Depends, Request, Response
from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker
from starlette.concurrency import run_in_threadpool

from core.effects import know
from service.access.auth import Caller, engineer
from service.errors import ForbiddenError
from service.http.parameters import Reading, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, table_responses
from service.jobs.tables import Job
from service.models import kept_effects
from service.models.api.effects import EffectName
from service.models.api.models import LOCATION
from service.models.kept_effects import KeptLaw
from service.models.schema import KeepRequest, KeptEffectRow, KeptEffects
from service.models.tables import KeptEffect

PYTHON = "text/x-python"
By = Annotated[Caller, Depends(engineer)]


async def known(sessions: Reading) -> None:
    """A dependency by which the request knows the kept effects."""
    know(kept_effects.effects(await run_in_threadpool(_laws, sessions)))


def knowing(admitted: Callable[[Request], Awaitable[Caller]]) -> Callable[..., Coroutine[Any, Any, Caller]]:
    """The dependency of another one's callers, by which the request also knows the kept effects."""

    async def caller(by: Annotated[Caller, Depends(admitted)], sessions: Reading) -> Caller:
        await known(sessions)
        return by

    return caller


def _laws(sessions: sessionmaker[Session]) -> tuple[KeptLaw, ...]:
    with sessions() as session:
        return kept_effects.laws(session)


router = APIRouter(prefix="/kept-effects", tags=["models"], route_class=TaggedRoute)


@router.get("", operation_id="list_kept_effects", **table_responses(KeptEffects))
def kept(sessions: Reading) -> KeptEffects:
    """Sketched laws that are kept as effects, by name, each with the sketch that it came from."""
    with sessions() as session:
        return KeptEffects(items=rows_for(session, kept_effects.rows(session)), next=None)


@router.post(
    "",
    operation_id="keep_effect",
    status_code=201,
    response_model=KeptEffectRow,
    responses=openapi_responses(400, 401, 403, 404, 409, 422, 429) | {201: {"headers": {"Location": LOCATION}}},
)
def keep(
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[KeepRequest, Body(description="A sketch, and a name of your own.")],
) -> KeptEffectRow:
    """Keep the law that a sketch proposes as an effect, which every model may then be given.

    The law is stored as values, and its code is written from them: a request brings no code. 409 if the sketch
    proposes nothing, or the name is that of another effect.
    """
    with sessions.begin() as session:
        made = kept_effects.keep(session, wanted.sketch, wanted.name, by.name, datetime.now(UTC))
        (answer,) = rows_for(session, [made])
    response.headers["Location"] = f"/api/v1/effects/{answer.name}"
    return answer


@router.get(
    "/{name}/file",
    operation_id="get_kept_effect_file",
    response_class=Response,
    responses=openapi_responses(401, 403, 404, 409, 422, 429)
    | {200: {"content": {PYTHON: {"schema": {"type": "string"}}}}},
)
def file(name: EffectName, sessions: Reading) -> Response:
    """A kept effect as a file of `effects_folder`, for the commands and notebooks."""
    with sessions() as session:
        law = kept_effects.law_of(session, name)
    return Response(
        law.source, media_type=PYTHON, headers={"Content-Disposition": f'attachment; filename="{law.name}.py"'}
    )


@router.delete(
    "/{name}",
    operation_id="delete_kept_effect",
    status_code=204,
    responses=openapi_responses(401, 403, 404, 409, 422, 429),
)
def delete(name: EffectName, sessions: Writing, by: By) -> None:
    """Delete a kept effect that no model has.

    Models of any building may have it, so only an engineer of all buildings can delete it.
    """
    check_may_delete(by)
    with sessions.begin() as session:
        kept_effects.delete(session, name)


def check_may_delete(by: Caller) -> None:
    """Refuse a caller that does not see the models of all buildings.

    Raises:
        ForbiddenError: it does not.
    """
    if by.buildings is not None:
        raise ForbiddenError(
            f"{by.name!r} is an engineer of some buildings only. Models of any building may have the effect, so only "
            "an engineer of all buildings can delete it."
        )


def rows_for(session: Session, stored: Sequence[KeptEffect]) -> list[KeptEffectRow]:
    """Kept effects as a session's caller may see them: without their origin in buildings that it may not see."""
    numbers = [one.job_id for one in stored]
    seen = set(session.scalars(select(Job.id).where(Job.id.in_(numbers))))
    return [
        KeptEffectRow(
            name=one.name,
            formula=KeptLaw.of(one.name, one.law).formula,
            created_at=one.created_at,
            author=one.author if one.job_id in seen else None,
            building=one.building if one.job_id in seen else None,
            model=one.model_id if one.job_id in seen else None,
            sketch=one.job_id if one.job_id in seen else None,
        )
        for one in stored
    ]
