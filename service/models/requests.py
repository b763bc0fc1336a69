"""Requests for work on a model, and reasons to refuse them."""

from collections.abc import Collection, Mapping
from datetime import datetime

from sqlalchemy.orm import Session

from core.description import BuildingDescription
from core.effects import EFFECTS
from core.errors import ModelError
from core.model.first_model import first_model
from core.model.isolator import Isolator
from service.buildings import queries as building_queries
from service.buildings.store import described
from service.errors import ConflictError
from service.jobs import queue as job_queue
from service.jobs.queue import COMPARE, DIAGNOSE, EXTEND, FIT
from service.jobs.tables import Job
from service.models import queries, versions as model_versions
from service.models.schema import EffectRequest, FitRequest, ModelRequest, WorkRequest
from service.models.tables import ModelVersion
from service.models.versions import DIRECTIONS, Draft


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
        raise ConflictError(
            f"{code} does not measure direction {' and '.join(missing)}; it measures {' and '.join(measured)}."
        )
    isolator, assumed = _begun(description, wanted.effects)
    reason = wanted.change or ("by the design values" if wanted.effects is None else "by values that were given")
    draft = Draft(wanted.direction, isolator, reason, by, revision.id, assumed=assumed)
    return model_versions.add(session, building.id, draft, now)


def _begun(
    description: BuildingDescription, effects: Mapping[str, Mapping[str, float]] | None
) -> tuple[Isolator, tuple[str, ...]]:
    """The model, and its parameters that were neither given nor measured."""
    if effects is None:
        first = first_model(description)
        return first.isolator, first.assumed
    try:
        return Isolator.of_all_values(effects), ()
    except ModelError as error:
        raise ConflictError(f"The values make no model: {error}.") from None


def compare(session: Session, model_id: int, wanted: WorkRequest, by: str, now: datetime) -> Job:
    """Queue a comparison with these events, or with all that can be compared.

    Raises:
        ConflictError: one of them cannot be compared, or none at all can.
    """
    model = queries.version(session, model_id)
    _check(session, model, wanted.events)
    return job_queue.enqueue_work(session, model, COMPARE, {"events": _kept(wanted.events)}, by, now)


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
        raise ConflictError(f"There is no effect {effect!r}; there are {', '.join(sorted(EFFECTS))}.")
    if effect in model.effects:
        raise ConflictError(f"The model has {effect} already; a fit determines its values.")
    arguments = _fitting(session, model, wanted) | {"effect": effect}
    return job_queue.enqueue_work(session, model, EXTEND, arguments, by, now)


def diagnose(session: Session, model_id: int, wanted: FitRequest, by: str, now: datetime) -> Job:
    """Queue a diagnosis by these events, or by all, except those held out.

    Raises:
        ConflictError: the events are refused as in `fit`.
    """
    model = queries.version(session, model_id)
    return job_queue.enqueue_work(session, model, DIAGNOSE, _fitting(session, model, wanted), by, now)


def _fitting(session: Session, model: ModelVersion, wanted: FitRequest) -> dict[str, object]:
    """Arguments of a job that fits."""
    out = set(wanted.hold_out or ())
    if both := sorted(out & set(wanted.events or ())):
        raise ConflictError(f"Events {', '.join(map(str, both))} are both held out and fitted; choose one.")
    _check(session, model, sorted(out))
    there = _check(session, model, wanted.events)
    if not there - out:
        raise ConflictError("Every event is held out; leave at least one to fit.")
    return {"events": _kept(wanted.events), "hold_out": sorted(out)}


def _kept(events: Collection[int] | None) -> list[int] | None:
    return None if events is None else sorted(set(events))


def _check(session: Session, model: ModelVersion, asked: Collection[int] | None) -> set[int]:
    """Numbers of the events asked for, of all where that is None."""
    found = queries.comparable(session, model.building_id, DIRECTIONS[model.direction], asked)
    if lacking := sorted({*(asked or ())} - {event.id for event in found}):
        raise ConflictError(
            f"With events {', '.join(map(str, lacking))} a model of direction {model.direction} cannot be compared: "
            "they are not this building's, or their analyses have no displacement of the isolation layer in it."
        )
    if asked is None and not found:
        raise ConflictError(
            f"No event can be compared with a model of direction {model.direction} yet: one that was analysed and "
            "has the isolation layer's displacement is needed."
        )
    return {event.id for event in found}
