"""Stored inputs of the work on a model."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from core.description import BuildingDescription
from core.effects import EFFECTS
from core.errors import RecordError
from core.model.isolator import Isolator
from service.analyses import store as analysis_store
from service.analyses.store import Inputs
from service.analyses.tables import Analysis
from service.buildings import store as building_store
from service.buildings.tables import Revision
from service.jobs.queue import Claim
from service.models import queries, texts
from service.models.queries import DIRECTIONS
from service.models.tables import ModelComparison, ModelVersion
from service.records.tables import Event
from service.settings import Settings

FITTED, HELD_OUT, LATER = "fitted", "held_out", "later"
"""Role of an event for a model."""


@dataclass(frozen=True, slots=True)
class ModelEvent:
    """An event that a model is compared with."""

    event_id: int
    analysis_id: int
    name: str
    """Name of the earthquake: its start."""
    start: datetime
    role: str
    """For the model as it is: FITTED, HELD_OUT or LATER."""
    is_held_out: bool
    """From a fit."""
    is_requested: bool
    """False of an event that only determines the state in which it left the layer."""


@dataclass(frozen=True, slots=True, eq=False)
class EventInputs:
    """An event, and all that its analysis was made from."""

    event: ModelEvent
    made_from: Inputs


@dataclass(frozen=True, slots=True, eq=False)
class WorkInputs:
    """A model, and the events that it is compared with."""

    model_id: int
    arguments: Mapping[str, Any]
    """The job's."""
    direction: str
    isolator: Isolator
    reference: datetime
    """From which effects count time."""
    description: BuildingDescription
    """The building's current one."""
    revision_id: int
    band: tuple[float, float]
    """Hz, within which forces are compared."""
    events: tuple[EventInputs, ...]
    """In order of time, one at least."""
    unusable: tuple[EventInputs, ...] = ()
    """Events without motion of the layer, in order of time; their records still give evidence on the sensors."""

    @property
    def roles(self) -> Mapping[int, str]:
        """Role of each event for the model as it is, by its number."""
        return {one.event.event_id: one.event.role for one in self.events}

    @property
    def directions(self) -> tuple[str, ...]:
        """Horizontal directions that the model holds in."""
        return DIRECTIONS[self.direction]


def work_inputs(session: Session, claim: Claim, settings: Settings) -> WorkInputs:
    """Inputs of a claimed job on a model.

    The job's `events` are the ones to work with, all comparable ones where it names none; its `hold_out` are held out
    of a fit. For a layer that remembers, every earlier event is there too.

    Raises:
        RecordError: none of the events can be compared.
    """
    model = session.get_one(ModelVersion, claim.model_id)
    isolator = Isolator(model.effects)
    named, hold_out = claim.arguments.get("events"), claim.arguments.get("hold_out") or ()
    there = queries.comparable(session, model.building_id, DIRECTIONS[model.direction], None)
    requested = {event.id for event in there if named is None or event.id in {*named, *hold_out}}
    last = max((event.start for event in there if event.id in requested), default=None)
    if last is None:
        raise RecordError(texts.NOT_COMPARABLE)
    before = [event for event in there if event.start <= last] if remembers(isolator) else ()
    events = [event for event in there if event.id in requested or event in before]
    revision = session.scalars(
        select(Revision).where(Revision.building_id == model.building_id).order_by(Revision.number.desc()).limit(1)
    ).one()
    inputs = tuple(
        _event_inputs(
            session,
            event,
            _role(session, model, event),
            is_held_out=event.id in hold_out,
            is_requested=event.id in requested,
        )
        for event in events
    )
    return WorkInputs(
        model_id=model.id,
        arguments=claim.arguments,
        direction=model.direction,
        isolator=isolator,
        reference=model.reference or inputs[0].event.start,
        description=building_store.parsed(revision).description,
        revision_id=revision.id,
        band=settings.analysis.band,
        events=inputs,
    )


def diagnosis_inputs(session: Session, claim: Claim, settings: Settings) -> WorkInputs:
    """The same for a diagnosis: where no events are named, with those whose analysis was refused.

    Raises:
        RecordError: none of the events can be compared.
    """
    inputs = work_inputs(session, claim, settings)
    if claim.arguments.get("events") is not None:
        return inputs
    model = session.get_one(ModelVersion, claim.model_id)
    refused = queries.not_comparable(session, model.building_id, inputs.directions)
    unusable = tuple(_event_inputs(session, event, LATER, is_held_out=False, is_requested=True) for event in refused)
    return replace(inputs, unusable=unusable)


def remembers(isolator: Isolator) -> bool:
    """True if the layer keeps any state from one earthquake to the next."""
    return any(EFFECTS[name].carried for name in isolator.effects)


def _event_inputs(session: Session, event: Event, role: str, *, is_held_out: bool, is_requested: bool) -> EventInputs:
    analysis = session.scalars(select(Analysis).where(Analysis.event_id == event.id, Analysis.current)).one()
    revision = session.get_one(Revision, analysis.revision_id)
    name = f"{event.start:%Y-%m-%dT%H:%M:%SZ}"
    return EventInputs(
        ModelEvent(event.id, analysis.id, name, event.start, role, is_held_out, is_requested),
        analysis_store.event_inputs(session, event, revision, analysis_store.settings_of(analysis)),
    )


def stored_event(session: Session, event: Event) -> EventInputs:
    """An analysed event alone, with all that its analysis was made from."""
    return _event_inputs(session, event, LATER, is_held_out=False, is_requested=True)


def _role(session: Session, model: ModelVersion, event: Event) -> str:
    """Role by the fit that made the model, or LATER."""
    of_event = (ModelComparison.model_id == model.id, ModelComparison.event_id == event.id)
    known: str | None = session.scalar(select(ModelComparison.role).where(*of_event).limit(1))
    return known or LATER
