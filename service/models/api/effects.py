"""The physical effects that a model of the isolation layer may have."""

from typing import Annotated

from fastapi import APIRouter, Path

from core.effect import Effect, explained
from core.effects import EFFECTS
from service.errors import NotFoundError
from service.http.paging import rows_of
from service.http.responses import TaggedRoute, responses, table_responses
from service.models.effects import families, law
from service.models.schema import EffectOut, Effects, ParameterOut

router = APIRouter(prefix="/effects", tags=["models"], route_class=TaggedRoute)

EffectName = Annotated[
    str, Path(description="Name of the effect.", pattern=r"^[A-Za-z0-9_-]{1,64}$", examples=[next(iter(EFFECTS))])
]


@router.get("", operation_id="list_effects", **table_responses(Effects))
def effects() -> Effects:
    """Every effect there is, by family."""
    named = [name for names in families(EFFECTS).values() for name in names]
    rows = [(name, effect.title, effect.family, effect.suspect_when) for name in named for effect in (EFFECTS[name],)]
    return rows_of(Effects, rows)


@router.get("/{name}", operation_id="get_effect", **responses(EffectOut, 404))
def effect(name: EffectName) -> EffectOut:
    """An effect: what it does, when to suspect it, its law, its parameters."""
    if name not in EFFECTS:
        raise NotFoundError("effect", name)
    return answered(name, EFFECTS[name])


def answered(name: str, effect: Effect) -> EffectOut:
    """All there is to say of it."""
    return EffectOut(
        name=name,
        title=effect.title,
        family=effect.family,
        suspect_when=effect.suspect_when,
        explanation=explained(effect, None),
        acts_on=effect.acts_on,
        kind=effect.kind,
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
