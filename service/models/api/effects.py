"""The physical effects that a model of the isolation layer may have."""

from typing import Annotated

from fastapi import APIRouter, Path, Request, Response

from core.effect import Effect
from core.effects import EFFECTS
from core.workbench.effect_sentences import explained
from service.errors import NotFoundError
from service.http.responses import Format, document, responses, table
from service.models.schema import EffectOut, EffectRow, Effects, ParameterOut
from service.models.workbench.effect_sheets import families, law

router = APIRouter(prefix="/effects", tags=["models"])

EffectName = Annotated[
    str, Path(description="Name of the effect.", pattern=r"^[A-Za-z0-9_-]{1,64}$", examples=[next(iter(EFFECTS))])
]


@router.get("", operation_id="list_effects", **responses(Effects, csv=True))
def effects(request: Request, format: Format = None) -> Response:
    """Every effect there is, by family."""
    named = [name for names in families(EFFECTS).values() for name in names]
    rows = [(name, effect.title, effect.family, effect.suspect_when) for name in named for effect in (EFFECTS[name],)]
    return table(request, format, tuple(EffectRow.model_fields), rows, None)


@router.get("/{name}", operation_id="get_effect", **responses(EffectOut, 404))
def effect(request: Request, name: EffectName) -> Response:
    """An effect: what it does, when to suspect it, its law, its parameters."""
    if name not in EFFECTS:
        raise NotFoundError("effect", name)
    return document(request, answered(name, EFFECTS[name]))


def answered(name: str, effect: Effect) -> EffectOut:
    """All there is to say of it."""
    return EffectOut(
        name=name,
        title=effect.title,
        family=effect.family,
        suspect_when=effect.suspect_when,
        explanation=explained(effect, None),
        acts_on=effect.acts_on,
        absent=dict(effect.absent),
        kept=list(effect.carried),
        parameters=[
            ParameterOut(
                name=one.name,
                unit=one.unit,
                lowest=one.bounds[0],
                highest=one.bounds[1],
                usual=one.prior.median,
                meaning=one.meaning,
            )
            for one in effect.parameters
        ],
        law=law(effect),
        source=effect.source,
    )
