"""Pages of the physical effects that a model may have."""

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response

from core.effect import PLACE
from core.effects import EFFECTS
from core.units import shown
from service.access.auth import Caller
from service.access.pages import reader
from service.errors import FieldsError, NotFoundError
from service.http.forms import NOT_REFUSED, refused
from service.http.rendering import page
from service.language.translation import said
from service.models.api.effects import EffectName, answered as effect_out
from service.models.effect_loops import AMPLITUDE, read_values, slider, usual_values
from service.models.effects import families

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(reader)]


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
