"""Requests for work on a model, and reasons to refuse them."""

from collections.abc import Collection, Mapping
from datetime import datetime
from keyword import iskeyword

from sqlalchemy import select
from sqlalchemy.orm import Session

from core.description import BuildingDescription
from core.effects import EFFECTS
from core.errors import ModelError
from core.model.first_model import first_model
from core.model.isolator import Isolator
from service.analyses.tables import Analysis
from service.buildings import queries as building_queries
from service.buildings.store import described
from service.errors import ConflictError
from service.jobs import queue as job_queue
from service.jobs.queue import COMPARE, DIAGNOSE, EXTEND, FIT, FORECAST, IMPROVE, SKETCH
from service.jobs.tables import Job
from service.models import queries, store, texts
from service.models.queries import DIRECTIONS
from service.models.schema import (
    EffectRequest,
    FitRequest,
    ForecastRequest,
    ForecastScaling,
    ModelRequest,
    SketchRequest,
    WorkRequest,
)
from service.models.store import Draft
from service.models.tables import ModelVersion
from service.models.uploads import KeptFile
from service.records import originals, queries as record_queries


def make(session: Session, code: str, wanted: ModelRequest, by: str, now: datetime) -> ModelVersion:
    """A model of given values, or without any the first one by the building's design values.

    Raises:
        NotFoundError: there is no such building.
        ConflictError: it does not measure that direction, or the values do not fit the effects there are.
    """
    building, revision = building_queries.building(session, code)
    description = described(session, building).description
    measured = description.horizontal_directions
    if missing := [one for one in DIRECTIONS[wanted.direction] if one not in measured]:
        raise ConflictError(f"{texts.not_measured(code, missing, measured)}.")
    isolator, assumed = _first(description, wanted.effects)
    reason = wanted.change or (texts.BY_DESIGN if wanted.effects is None else texts.BY_VALUES)
    draft = Draft(wanted.direction, isolator, reason, by, revision.id, assumed=assumed)
    return store.add(session, building.id, draft, now)


def _first(
    description: BuildingDescription, effects: Mapping[str, Mapping[str, float]] | None
) -> tuple[Isolator, tuple[str, ...]]:
    """The model, and its parameters that were neither given nor measured."""
    if effects is None:
        first = first_model(description)
        return first.isolator, first.assumed
    try:
        return Isolator.of_all_values(effects), ()
    except ModelError as error:
        raise ConflictError(texts.no_model(error)) from None


def compare(session: Session, model_id: int, wanted: WorkRequest, by: str, now: datetime) -> Job:
    """Queue a comparison with these events, or with all that can be compared.

    Raises:
        ConflictError: one of them cannot be compared, or none at all can.
    """
    model = queries.version(session, model_id)
    _check(session, model, wanted.events)
    return job_queue.enqueue_work(session, model, COMPARE, {"events": _sorted(wanted.events)}, by, now)


def fit(session: Session, model_id: int, wanted: FitRequest, by: str, now: datetime) -> Job:
    """Queue a fit to these events, or to all that can be compared, but those held out.

    Raises:
        ConflictError: one of them cannot be compared, or is both fitted and held out, or none is left to fit to.
    """
    model = queries.version(session, model_id)
    return job_queue.enqueue_work(session, model, FIT, _fitting(session, model, wanted), by, now)


def extend(session: Session, model_id: int, wanted: EffectRequest, by: str, now: datetime) -> Job:
    """Queue a fit with one more effect, as `fit` does without.

    Raises:
        ConflictError: there is no such effect, the model has it, or the events are refused as in `fit`.
    """
    model, effect = queries.version(session, model_id), wanted.effect
    if effect not in EFFECTS:
        raise ConflictError(texts.unknown_effect(effect, EFFECTS))
    if effect in model.effects:
        raise ConflictError(texts.has_effect(effect))
    arguments = _fitting(session, model, wanted) | {"effect": effect}
    return job_queue.enqueue_work(session, model, EXTEND, arguments, by, now)


def improve(session: Session, model_id: int, wanted: FitRequest, by: str, now: datetime) -> Job:
    """Queue an improvement by these events, or by all, except those held out.

    Raises:
        ConflictError: the events are refused as in `fit`.
    """
    model = queries.version(session, model_id)
    return job_queue.enqueue_work(session, model, IMPROVE, _fitting(session, model, wanted), by, now)


def diagnose(session: Session, model_id: int, wanted: FitRequest, by: str, now: datetime) -> Job:
    """Queue a diagnosis by these events, or by all, except those held out.

    Raises:
        ConflictError: the events are refused as in `fit`.
    """
    model = queries.version(session, model_id)
    return job_queue.enqueue_work(session, model, DIAGNOSE, _fitting(session, model, wanted), by, now)


def sketch(session: Session, model_id: int, wanted: SketchRequest, by: str, now: datetime) -> Job:
    """Queue a sketch of what the model lacks in these events, or in all; those held out only test the law.

    Raises:
        ConflictError: an effect cannot have that name, or the events are refused as in `fit`.
    """
    model = queries.version(session, model_id)
    arguments = _fitting(session, model, wanted)
    if wanted.name is not None:
        check_new_name(wanted.name)
        arguments["name"] = wanted.name
    return job_queue.enqueue_work(session, model, SKETCH, arguments, by, now)


def check_new_name(name: str) -> None:
    """Refuse a name that a new effect cannot have.

    Raises:
        ConflictError: it is another effect's, or a word of the language of effects.
    """
    if name in EFFECTS or not name.isidentifier() or iskeyword(name):
        raise ConflictError(texts.taken_name(name))


def forecast(session: Session, model_id: int, wanted: ForecastRequest, by: str, now: datetime) -> Job:
    """Queue a forecast of the response to the ground motion of a stored event.

    Raises:
        NotFoundError: there is no such event.
        ConflictError: it is not analysed, no event shows the model's error, it is to be scaled to several things, or
            the building file has no design spectrum to scale to.
    """
    model = queries.version(session, model_id)
    _check_scaling(session, model, wanted)
    event = record_queries.event(session, wanted.earthquake)
    if session.scalar(select(Analysis.id).where(Analysis.event_id == event.id, Analysis.current)) is None:
        raise ConflictError(texts.not_analysed(event.id))
    return job_queue.enqueue_work(session, model, FORECAST, wanted.model_dump(exclude_none=True), by, now)


def forecast_uploaded(
    session: Session, model_id: int, file: KeptFile, wanted: ForecastScaling, by: str, now: datetime
) -> Job:
    """Queue a forecast of the response to an uploaded ground motion, which `uploads.check` has accepted.

    Raises:
        ConflictError: as of `forecast`.
    """
    model = queries.version(session, model_id)
    _check_scaling(session, model, wanted)
    originals.add(session, file.data)
    motion = {"name": file.name, "sha256": file.data.sha256}
    arguments = {"motion": motion, **wanted.model_dump(exclude_none=True)}
    return job_queue.enqueue_work(session, model, FORECAST, arguments, by, now)


def _check_scaling(session: Session, model: ModelVersion, wanted: ForecastScaling) -> None:
    if sum([wanted.pga is not None, wanted.displacement is not None, wanted.design_spectrum]) > 1:
        raise ConflictError(texts.ONE_SCALING)
    _check(session, model, None)
    if wanted.design_spectrum and described(session, model.building).design_spectrum is None:
        raise ConflictError(texts.NO_DESIGN_SPECTRUM)


def _fitting(session: Session, model: ModelVersion, wanted: FitRequest) -> dict[str, object]:
    """Arguments of a job that fits."""
    held_out = set(wanted.hold_out or ())
    if both := sorted(held_out & set(wanted.events or ())):
        raise ConflictError(texts.both_fitted_and_held_out(both))
    _check(session, model, sorted(held_out))
    there = _check(session, model, wanted.events)
    if not there - held_out:
        raise ConflictError(texts.ALL_HELD_OUT)
    return {"events": _sorted(wanted.events), "hold_out": sorted(held_out)}


def _sorted(events: Collection[int] | None) -> list[int] | None:
    return None if events is None else sorted(set(events))


def _check(session: Session, model: ModelVersion, named: Collection[int] | None) -> set[int]:
    """Numbers of the named events, of all comparable ones where that is None."""
    there = queries.comparable(session, model.building_id, DIRECTIONS[model.direction], named)
    if lacking := sorted({*(named or ())} - {event.id for event in there}):
        raise ConflictError(texts.events_not_comparable(lacking, model.direction))
    if named is None and not there:
        raise ConflictError(texts.no_event_comparable(model.direction))
    return {event.id for event in there}
