"""Pages of the physical effects that a model may have."""

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from core.effect import PLACE
from core.effects import EFFECTS
from core.units import shown
from service.access.auth import Caller, Role, engineer
from service.access.pages import reader
from service.errors import ConflictError, FieldsError, NotFoundError
from service.http.forms import NOT_REFUSED, Refused, refused
from service.http.parameters import Reading, Writing
from service.http.rendering import page
from service.language.translation import said
from service.models import kept_effects
from service.models.api.effects import EffectName, answered as effect_out
from service.models.api.kept_effects import check_may_delete, knowing, rows_for
from service.models.effect_loops import AMPLITUDE, read_values, slider, usual_values
from service.models.effects import families

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(knowing(reader))]
By = Annotated[Caller, Depends(knowing(engineer))]


@router.get("/effects")
def effects(request: Request, _: Reader) -> Response:
    """The physical effects that a model may have."""
    return page(request, "effects", families=families(EFFECTS), effects=EFFECTS)


@router.get("/effects/{name}")
def effect(request: Request, name: EffectName, sessions: Reading, by: Reader) -> Response:
    """One of them, explained, with its loop at the values of the query."""
    return _shown(request, name, sessions, by)


def _shown(
    request: Request, name: str, sessions: sessionmaker[Session], by: Caller, of_deletion: Refused = NOT_REFUSED
) -> Response:
    if name not in EFFECTS:
        raise NotFoundError("effect", name)
    refusal, typed = NOT_REFUSED, dict(request.query_params)
    try:
        values, amplitude = read_values(name, typed)
    except FieldsError as error:
        refusal = refused("values", typed, error)
        values, amplitude = usual_values(name), AMPLITUDE
    parameters = EFFECTS[name].parameters
    with sessions() as session:
        stored = kept_effects.row(session, name)
        kept = None if stored is None else rows_for(session, [stored])[0]
    return page(
        request,
        "effect",
        of_deletion.status if of_deletion else refusal.status,
        refused=of_deletion or refusal,
        kept=kept,
        may_delete=kept is not None and by.role >= Role.engineer and by.buildings is None,
        effect=effect_out(name, EFFECTS[name]),
        explanation=_explanation(name),
        sliders={one.name: slider(one) for one in parameters},
        typed={one.name: f"{shown(values[one.name], one.unit):.6g}" for one in parameters}
        | {"amplitude": f"{amplitude * 1e3:g}"},
    )


@router.post("/effects/{name}/delete")
def delete(request: Request, name: EffectName, sessions: Writing, by: By) -> Response:
    """Delete a kept effect, and show those that are left."""
    check_may_delete(by)
    try:
        with sessions.begin() as session:
            kept_effects.delete(session, name)
    except ConflictError as error:
        return _shown(request, name, sessions, by, refused("delete", {}, error))
    return RedirectResponse("/effects", 303)


def _explanation(name: str) -> str:
    """Explanation of an effect with the names of its parameters, which are not translated."""
    return PLACE.sub(r"\1", said(PLACE.sub(r"{\1}", EFFECTS[name].explanation)))
