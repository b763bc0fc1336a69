"""What work on a model is made from, as it is stored now."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from sqlalchemy import select
from sqlalchemy.orm import Session

from core.description import BuildingDescription
from core.errors import RecordError
from core.isolator import Isolator
from service import building_file, results
from service.database import Analysis, Event, ModelComparison, ModelVersion, Revision
from service.jobs import Claim
from service.models import DIRECTIONS
from service.queries import versions
from service.results import Inputs
from service.settings import Settings

FITTED, LEFT_OUT, LATER = "fitted", "left_out", "later"
"""What an event is to a model."""


@dataclass(frozen=True, slots=True, eq=False)
class EventInputs:
    """An event, and how it was analysed."""

    event_id: int
    analysis_id: int
    name: str
    """Of the earthquake: its start."""
    start: datetime
    role: str
    """FITTED, LEFT_OUT or LATER."""
    made_from: Inputs


@dataclass(frozen=True, slots=True, eq=False)
class WorkInputs:
    """A model, and the events that it is held against."""

    model_id: int
    direction: str
    isolator: Isolator
    reference: datetime
    """From which effects count time."""
    description: BuildingDescription
    """The building's, in force."""
    revision_id: int
    band: tuple[float, float]
    """Hz, within which forces are compared."""
    events: tuple[EventInputs, ...]
    """In order of time, one at least."""

    @property
    def directions(self) -> tuple[str, ...]:
        """Horizontal directions that the model holds in."""
        return DIRECTIONS[self.direction]


def work_inputs(session: Session, claim: Claim, settings: Settings) -> WorkInputs:
    """What the work of a claimed job on a model is made from.

    The job's `events` are the ones to work with, all comparable ones where it names none; its `hold_out` are left out
    of a fit.

    Raises:
        RecordError: none of the events can be compared.
    """
    model = session.get_one(ModelVersion, claim.model_id)
    wanted, hold_out = claim.arguments.get("events"), claim.arguments.get("hold_out", ())
    among = None if wanted is None else {*wanted, *hold_out}
    events = versions.comparable(session, model.building_id, DIRECTIONS[model.direction], among)
    if not events:
        raise RecordError(
            "none of these events has the isolation layer's motion and force in the model's direction; events that "
            "were analysed, at a building with a transducer or accelerometers on both sides of the layer, would do"
        )
    revision = session.scalars(
        select(Revision).where(Revision.building_id == model.building_id).order_by(Revision.number.desc()).limit(1)
    ).one()
    found = tuple(_event_inputs(session, event, _role(session, model, event, hold_out)) for event in events)
    return WorkInputs(
        model_id=model.id,
        direction=model.direction,
        isolator=Isolator(model.effects),
        reference=model.reference or found[0].start,
        description=building_file.read(revision.toml, Path(revision.folder)).description,
        revision_id=revision.id,
        band=settings.band,
        events=found,
    )


def _event_inputs(session: Session, event: Event, role: str) -> EventInputs:
    analysis = session.scalars(select(Analysis).where(Analysis.event_id == event.id, Analysis.current)).one()
    revision = session.get_one(Revision, analysis.revision_id)
    return EventInputs(
        event_id=event.id,
        analysis_id=analysis.id,
        name=f"{event.start:%Y-%m-%dT%H:%M:%SZ}",
        start=event.start,
        role=role,
        made_from=results.event_inputs(session, event, revision, results.settings_of(analysis)),
    )


def _role(session: Session, model: ModelVersion, event: Event, hold_out: Collection[int]) -> str:
    """What the event is to the model by itself: the fit that made the model has said so, or it came later."""
    of_event = (ModelComparison.model_id == model.id, ModelComparison.event_id == event.id)
    known: Sequence[str] = session.scalars(select(ModelComparison.role).where(*of_event).limit(1)).all()
    return LEFT_OUT if event.id in hold_out else known[0] if known else LATER
