"""Effects of the engineers' own: sketched laws, kept as values in the database, from which their code is written.

A request brings a name and the number of a sketch, and never code. Each request and each job has the effects that the
database has when it begins, in whichever process it runs; no process keeps them.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from datetime import datetime
from functools import lru_cache, partial
from typing import Any

from sqlalchemy import Text, cast, select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from core.effect import Effect
from core.effects import also, only
from core.errors import ModelError
from core.sketching.law import Law, effect_of, effect_source, formula
from core.sketching.terms import Scales
from service.errors import ConflictError, NotFoundError
from service.jobs import requests as job_requests
from service.jobs.queue import DIAGNOSE, EXTEND, IMPROVE, UNDER_WAY, Claim
from service.jobs.stages import Kind, ReportStep, Stage
from service.jobs.tables import Job
from service.models import texts
from service.models.sketch_results import LawOut, SketchDocument
from service.models.tables import KeptEffect, ModelVersion
from service.settings import Settings
from service.version import VERSION


@dataclass(frozen=True, slots=True)
class KeptLaw:
    """A kept law, as it goes to the processes that compute."""

    name: str
    """Name of the effect."""
    terms: tuple[tuple[str, float, float], ...]
    """Name of each term, its own value (SI) and its amplitude (N)."""
    displacement: float
    """m, the largest in its records."""
    velocity: float
    """m/s."""

    @classmethod
    def of(cls, name: str, stored: Any) -> "KeptLaw":  # noqa: ANN401  JSON
        """The law of a row."""
        law = LawOut.model_validate(stored)
        terms = tuple((one.term, one.own, one.amplitude) for one in law.terms)
        return cls(name, terms, law.displacement, law.velocity)

    @property
    def law(self) -> Law:
        """The law.

        Raises:
            ModelError: it has a term that this version does not know.
        """
        return Law.of_terms(self.terms, Scales(self.displacement, self.velocity))

    @property
    def formula(self) -> str | None:
        """The law in a line; None if it has a term that this version does not know."""
        try:
            return formula(self.law)
        except ModelError:
            return None

    @property
    def source(self) -> str:
        """Text of the effect's file.

        Raises:
            ConflictError: this version does not know a term.
        """
        try:
            return effect_source(self.name, self.law)
        except ModelError as error:
            raise ConflictError(texts.unknown_term(self.name, str(error))) from None


@lru_cache(1024)
def _effect(law: KeptLaw) -> Effect | None:
    """The same effect each time, so that a process compiles it once; None as of `formula`."""
    return effect_of(law.name, law.source) if law.formula is not None else None


def effects(laws: Sequence[KeptLaw]) -> dict[str, Effect]:
    """The effects of laws, by name; those with a term that this version does not know are left out."""
    return {law.name: effect for law in laws if (effect := _effect(law)) is not None}


def rows(session: Session) -> Sequence[KeptEffect]:
    """All kept effects, by name."""
    return session.scalars(select(KeptEffect).order_by(KeptEffect.name)).all()


def laws(session: Session) -> tuple[KeptLaw, ...]:
    """The laws of all kept effects, by name."""
    found = session.execute(select(KeptEffect.name, KeptEffect.law).order_by(KeptEffect.name))
    return tuple(KeptLaw.of(name, law) for name, law in found)


def row(session: Session, name: str) -> KeptEffect | None:
    """A kept effect; None if there is none of that name."""
    return session.scalars(select(KeptEffect).where(KeptEffect.name == name)).one_or_none()


def law_of(session: Session, name: str) -> KeptLaw:
    """The law of a kept effect.

    Raises:
        NotFoundError: there is none of that name.
    """
    found = row(session, name)
    if found is None:
        raise NotFoundError("kept effect", name)
    return KeptLaw.of(found.name, found.law)


def keep(session: Session, sketch: int, name: str, by: str, now: datetime) -> KeptEffect:
    """Keep the law of a sketch as an effect of every model.

    Args:
        session: within a request, whose context has the effects that are kept already.
        sketch: number of its job.
        name: of the effect.
        by: name of the key.
        now: aware time.

    Raises:
        NotFoundError: there is no such sketch.
        ConflictError: it proposes nothing, an earlier version made it, or no effect can have that name.
    """
    job = job_requests.job(session, sketch)
    if job.model is None or "sketch" not in (job.result or {}):
        raise NotFoundError("sketch", sketch)
    proposal = SketchDocument.model_validate((job.result or {})["sketch"]).proposal
    if proposal is None:
        raise ConflictError(texts.NOTHING_PROPOSED)
    if proposal.law is None:
        raise ConflictError(texts.SKETCHED_EARLIER)
    from service.models.requests import check_new_name  # a worker keeps nothing, and needs none of the API's schemas

    check_new_name(name)
    made = KeptEffect(
        name=name,
        law=proposal.law.model_dump(),
        building=job.model.building.code,
        model_id=job.model.id,
        job_id=job.id,
        author=by,
        created_at=now,
        version=VERSION,
    )
    session.add(made)
    try:
        session.flush()
    except IntegrityError:  # another request kept that name meanwhile
        raise ConflictError(texts.taken_name(name)) from None
    return made


def delete(session: Session, name: str) -> None:
    """Delete a kept effect that no model has.

    Args:
        session: that sees the models of all buildings.
        name: of the effect.

    Raises:
        NotFoundError: there is none of that name.
        ConflictError: a model has it, or work under way may give it to one.
    """
    found = row(session, name)
    if found is None:
        raise NotFoundError("kept effect", name)
    written = cast(ModelVersion.effects, Text).contains(f'"{name}"', autoescape=True)
    candidates = session.execute(select(ModelVersion.id, ModelVersion.effects).where(written).order_by(ModelVersion.id))
    if users := [number for number, values in candidates if name in values]:
        raise ConflictError(texts.effect_in_use(name, users))
    under_way = session.scalars(select(Job).where(Job.kind.in_((EXTEND, IMPROVE)), Job.state.in_(UNDER_WAY)))
    for job in under_way:
        if job.kind == IMPROVE or job.arguments.get("effect") == name:
            raise ConflictError(texts.effect_wanted(name, job.id))
    session.delete(found)


@contextmanager
def known(there: Sequence[KeptLaw], alone: frozenset[str] | None = None) -> Iterator[None]:
    """Within this context there are these effects too.

    Args:
        there: their laws.
        alone: names of all effects that are there; None for all of the process and these.
    """
    with also(effects(there)) if there else nullcontext(), nullcontext() if alone is None else only(alone):
        yield


@dataclass(frozen=True, slots=True, eq=False)
class _Inputs:
    """Inputs of a job, and the kept effects that it may need."""

    there: tuple[KeptLaw, ...]
    alone: frozenset[str] | None
    """Names of the effects that it computes with; None for all."""
    of_kind: Any


def knowing(kind: Kind) -> Kind:
    """The same kind of work on a model, where the kept effects are known.

    A computation for a model with kept effects has the effects of that model alone, which compile in seconds; where
    nothing but effects of the process is needed, its compiled program remains. Diagnoses and improvements have all.
    """

    def inputs(session: Session, claim: Claim, settings: Settings) -> _Inputs:
        there = laws(session)
        with known(there):
            found = kind.inputs(session, claim, settings)
        if not there or claim.kind in (DIAGNOSE, IMPROVE):
            return _Inputs(there, None, found)
        own = {*session.get_one(ModelVersion, claim.model_id).effects, *filter(None, [claim.arguments.get("effect")])}
        needed = tuple(one for one in there if one.name in own)
        return _Inputs(needed, frozenset(own) if needed else None, found)

    def stages(given: _Inputs) -> Sequence[Stage]:
        made = kind.stages(given.of_kind)
        return [_knowing(one, given) if given.there and one.key is None else one for one in made]

    def store(session: Session, claim: Claim, given: _Inputs, done: Sequence[Any], now: datetime) -> None:
        with known(given.there):
            kind.store(session, claim, given.of_kind, done, now)

    return Kind(inputs, stages, store)


def _knowing(stage: Stage, given: _Inputs) -> Stage:
    def arguments(done: Sequence[Any], report_step: ReportStep) -> tuple[Any, ...]:
        with known(given.there):
            return stage.arguments(done, report_step)

    return replace(stage, function=partial(_within, given.there, given.alone, stage.function), arguments=arguments)


def _within(
    there: tuple[KeptLaw, ...],
    alone: frozenset[str] | None,
    function: Callable[..., Any],
    *arguments: Any,  # noqa: ANN401  a computation's
) -> Any:  # noqa: ANN401  its result
    """A computation in whichever process or thread it runs."""
    with known(there, alone):
        return function(*arguments)
