"""Jobs that forecast the response to the ground motion of a stored earthquake, or to one that was uploaded."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import PurePath
from typing import Any

from sqlalchemy.orm import Session

from core.analysis import EventAnalysis, analyse
from core.errors import RecordError
from core.forecasting.ground_motion import GroundMotion, Scaling, ToDisplacement, ToPga, ToSpectrum
from core.workbench.earthquakes import Earthquakes
from core.workbench.forecasting import last_end
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.tables import Building, Revision
from service.errors import NotFoundError
from service.jobs.queue import Claim
from service.jobs.stages import ReportStep, Stage
from service.jobs.tables import Job
from service.models import texts
from service.models.comparing import given, observing, records
from service.models.forecast_results import document
from service.models.forecasting import forecast
from service.models.inputs import FITTED, EventInputs, WorkInputs, stored_event, work_inputs
from service.models.model_file import ModelFile
from service.models.results import as_json
from service.models.uploads import uploaded_motion
from service.records import originals
from service.records.file_store import LostFileError
from service.records.tables import Event
from service.settings import Settings

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Uploaded:
    """A file of a ground motion."""

    name: str
    data: bytes


@dataclass(frozen=True, slots=True, eq=False)
class ForecastInputs:
    """A model with its events, the building's limits, and the event whose ground moves."""

    work: WorkInputs
    file: BuildingFile
    """Limits and design spectrum of the building."""
    motion: EventInputs | Uploaded
    name: str
    """Name of the motion: with the building's code if it is another one's."""
    at: datetime
    """Time of the request: the earthquake comes then."""


def inputs(session: Session, claim: Claim, settings: Settings) -> ForecastInputs:
    """Inputs of a claimed forecast: the events that the model was fitted to, all comparable ones if there are none.

    Raises:
        RecordError: no event can be compared with the model.
    """
    work = work_inputs(session, claim, settings)
    if any(one.event.role == FITTED for one in work.events):
        work = replace(
            work,
            events=tuple(
                replace(one, event=replace(one.event, is_held_out=one.event.role != FITTED)) for one in work.events
            ),
        )
    file = building_store.parsed(session.get_one(Revision, work.revision_id))
    at = session.get_one(Job, claim.job_id).created_at
    if (uploaded := claim.arguments.get("motion")) is not None:
        try:
            data = originals.read(session, uploaded["sha256"], settings.storage)
        except LostFileError as error:
            log.warning("job %d: %s", claim.job_id, error)
            raise RecordError(texts.FILE_GONE) from None
        name = uploaded["name"]
        return ForecastInputs(work, file, Uploaded(name, data), PurePath(name).stem, at)
    event = session.get(Event, claim.arguments["earthquake"])
    if event is None:
        raise RecordError(str(NotFoundError("event", claim.arguments["earthquake"])))
    motion = stored_event(session, event)
    code = session.get_one(Building, event.building_id).code
    name = motion.event.name if code == work.description.code else f"{code}, {motion.event.name}"
    return ForecastInputs(work, file, motion, name, at)


def stages(of: ForecastInputs) -> Sequence[Stage]:
    """Stages of a forecast: each event, that of the ground motion, then the response."""
    count = len(of.work.events)
    return (
        *observing(of.work),
        _moving(of),
        Stage(
            texts.FORECASTING,
            forecast_document,
            lambda done, report_step: (
                given(of.work),
                records(of.work, done[:count]),
                done[count] if isinstance(of.motion, Uploaded) else _of_event(of.name, of.motion, done[count]),
                of.file,
                scaling(of.work.arguments, of.file),
                of.at,
                of.work.arguments.get("temperature"),
                report_step,
            ),
        ),
    )


def _moving(of: ForecastInputs) -> Stage:
    """The stage that reads the ground motion."""
    if isinstance(of.motion, Uploaded):
        given_file = (of.motion.name, of.motion.data, of.file)
        return Stage(texts.UPLOADED, uploaded_motion, lambda _, report_step: given_file)
    made_from = of.motion.made_from
    arguments = (made_from.segments, made_from.description, made_from.settings)
    return Stage(texts.reading_event(of.motion.event.name), analyse, lambda _, report_step: arguments, made_from.key)


def _of_event(name: str, event: EventInputs, analysis: EventAnalysis) -> GroundMotion:
    return ground_motion(name, analysis, event.made_from.description.ground.name)


def forecast_document(
    model: ModelFile,
    events: Earthquakes,
    motion: GroundMotion,
    file: BuildingFile,
    wanted: Scaling | None,
    at: datetime,
    temperature: float | None,
    report_step: ReportStep,
) -> Mapping[str, Any]:
    """The forecast as JSON; the earthquake comes after the last record at the earliest.

    Raises:
        RecordError: nothing to forecast from, or an impossible scaling.
        ModelError: the model's force or response grew beyond all bounds.
    """
    moment = max(at, last_end(events)) if events.observations else at
    return as_json(document(forecast(model, events, [motion], file, wanted, moment, temperature, report_step)))


def ground_motion(name: str, analysis: EventAnalysis, ground: str) -> GroundMotion:
    """The ground's motion in an analysed event.

    Args:
        name: of the motion.
        analysis: of the event.
        ground: name of the level below the isolators.

    Raises:
        RecordError: no usable record of it.
    """
    record = analysis.record
    if record is None or all(record.find(ground, "acceleration", direction) is None for direction in ("x", "y")):
        raise RecordError(texts.no_ground_motion(name))
    found = {direction: record.find(ground, "acceleration", direction) for direction in ("x", "y", "z")}
    return GroundMotion.of(name, record.rate, **found)


def scaling(arguments: Mapping[str, Any], file: BuildingFile) -> Scaling | None:
    """The scaling that a job asks for; None for the motion as it is."""
    if "pga" in arguments:
        return ToPga(arguments["pga"])
    if "displacement" in arguments:
        return ToDisplacement(arguments["displacement"])
    if arguments.get("design_spectrum") and file.design_spectrum is not None:
        return ToSpectrum(file.design_spectrum.periods, file.design_spectrum.acceleration)
    return None


def store(session: Session, claim: Claim, of: ForecastInputs, done: Sequence[Any], now: datetime) -> None:
    """The forecast, as the job's result."""
    session.get_one(Job, claim.job_id).result = {"forecast": dict(done[-1])}
