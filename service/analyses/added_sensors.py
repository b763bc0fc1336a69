"""Gain in certainty by one more accelerometer: requests, jobs, and the document of commands, API, pages. SI units."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from core.analysis import AnalysisSettings, EventAnalysis, analyse
from core.description import BuildingDescription
from core.errors import RecordError
from core.workbench.added_sensors import AddedSensor, AddedSensors, Today, added_sensors
from service.analyses.store import Inputs, analysis_settings, event_inputs, settings_of
from service.analyses.tables import Analysis
from service.buildings import queries as building_queries
from service.buildings.store import parsed
from service.buildings.tables import Revision
from service.errors import ConflictError, NotFoundError
from service.jobs import queue as job_queue, requests as job_requests
from service.jobs.queue import SENSORS, Claim
from service.jobs.stages import ReportStep, Stage
from service.jobs.tables import Job
from service.records.tables import Event
from service.schema import Number
from service.settings import Settings
from service.version import VERSION

MOST = 10
"""Earthquakes that a job takes unless it names some: the strongest. A choice: the gain changes little with more, and
each takes some seconds to calibrate."""
NONE_ANALYSED = "The building has no analysed earthquake, from whose records the gain could be computed."
ESTIMATING = "Calibrating the superstructure"


class TodayOut(BaseModel):
    """Standard deviations in one direction with the sensors that there are."""

    direction: str
    records: int
    force: Number = Field(description="N.")
    frequency: list[Number] = Field(description="Hz, fixed-base modes.")
    frequency_std: list[Number] = Field(description="Hz.")

    @classmethod
    def of(cls, one: Today) -> "TodayOut":
        """The same of core."""
        return cls(
            direction=one.direction,
            records=one.records,
            force=one.force,
            frequency=one.frequency.tolist(),
            frequency_std=one.frequency_std.tolist(),
        )


class SensorOut(BaseModel):
    """One more accelerometer; ratios are of standard deviations with it to those without."""

    direction: str
    level: str
    force: Number = Field(description="N, standard deviation of the force with it.")
    force_ratio: Number
    frequency_ratios: list[Number] = Field(description="By mode.")
    damping_ratios: list[Number] = Field(description="By mode.")

    @classmethod
    def of(cls, one: AddedSensor) -> "SensorOut":
        """The same of core."""
        return cls(
            direction=one.direction,
            level=one.level,
            force=one.force,
            force_ratio=one.force_ratio,
            frequency_ratios=one.frequency_ratios.tolist(),
            damping_ratios=one.damping_ratios.tolist(),
        )


class AddedSensorsDocument(BaseModel):
    """Every level without an accelerometer, that which narrows the force most first."""

    version: str = VERSION
    building: str
    today: list[TodayOut]
    sensors: list[SensorOut]
    sentences: list[str] = Field(description="The same in words.")
    remarks: list[str] = Field(description="Records that could not be used, with the reason.")


def document(result: AddedSensors) -> AddedSensorsDocument:
    """The result as a document."""
    return AddedSensorsDocument(
        building=result.building,
        today=[TodayOut.of(one) for one in result.today],
        sensors=[SensorOut.of(one) for one in result.sensors],
        sentences=list(result.text),
        remarks=list(result.remarks),
    )


@dataclass(frozen=True, slots=True, eq=False)
class JobInputs:
    """The earthquakes of a job, and the building as it is described now."""

    description: BuildingDescription
    settings: AnalysisSettings
    earthquakes: tuple[Inputs, ...]
    """In order of time, one at least."""
    names: tuple[str, ...]
    """Starts of the earthquakes."""


def request(session: Session, code: str, events: Collection[int] | None, by: str, now: datetime) -> Job:
    """Queue the computation, from some earthquakes or from the strongest.

    Raises:
        NotFoundError: there is no such building.
        ConflictError: one of the earthquakes is not analysed, or none is.
    """
    building, _ = building_queries.building(session, code)
    there = _analysed(session, building.id, events)
    if lacking := sorted({*(events or ())} - {event.id for event, _ in there}):
        raise ConflictError(f"The building {code} has no analysed earthquake {', '.join(map(str, lacking))}.")
    if not there:
        raise ConflictError(NONE_ANALYSED)
    arguments: Mapping[str, Any] = {} if events is None else {"events": sorted(set(events))}
    return job_queue.enqueue_sensors(session, building.id, arguments, by, now)


def _analysed(session: Session, building_id: int, events: Collection[int] | None) -> list[tuple[Event, Analysis]]:
    """Analysed earthquakes with their analyses, in order of time: those named, or the strongest."""
    question = (
        select(Event, Analysis)
        .join(Analysis, Analysis.event_id == Event.id)
        .where(Event.building_id == building_id, Analysis.current, Analysis.refusal.is_(None))
    )
    if events is not None:
        question = question.where(Event.id.in_(events))
    strongest = question.order_by(func.coalesce(Analysis.pga, 0.0).desc(), Event.id.desc()).limit(MOST)
    rows = session.execute(strongest if events is None else question)
    return sorted(((event, analysis) for event, analysis in rows), key=lambda pair: pair[0].start)


def inputs(session: Session, claim: Claim, settings: Settings) -> JobInputs:
    """The inputs of a claimed job, as stored now.

    Raises:
        RecordError: no earthquake is analysed any more.
    """
    there = _analysed(session, claim.building_id or 0, claim.arguments.get("events"))
    if not there:
        raise RecordError(NONE_ANALYSED)
    current = session.scalars(
        select(Revision).where(Revision.building_id == claim.building_id).order_by(Revision.number.desc()).limit(1)
    ).one()
    return JobInputs(
        parsed(current).description,
        analysis_settings(settings, {}),
        tuple(
            event_inputs(session, event, session.get_one(Revision, analysis.revision_id), settings_of(analysis))
            for event, analysis in there
        ),
        tuple(f"{event.start:%Y-%m-%dT%H:%M:%SZ}" for event, _ in there),
    )


def stages(given: JobInputs) -> Sequence[Stage]:
    """Stages of the computation: each earthquake, then the gains."""
    reading = [_reading(*one) for one in zip(given.names, given.earthquakes, strict=True)]
    count = len(reading)
    return (
        *reading,
        Stage(
            ESTIMATING,
            computed,
            lambda done, report_step: (tuple(done[:count]), given.description, given.settings, report_step),
        ),
    )


def _reading(name: str, one: Inputs) -> Stage:
    arguments = (one.segments, one.description, one.settings)
    return Stage(f"Reading the earthquake of {name}", analyse, lambda _, report_step: arguments, one.key)


def computed(
    analyses: Sequence[EventAnalysis],
    description: BuildingDescription,
    settings: AnalysisSettings,
    report_step: ReportStep,
) -> Mapping[str, Any]:
    """The gains as JSON.

    Raises:
        RecordError: no record shows the superstructure in any direction.
    """
    return document(added_sensors(analyses, description, settings, progress=report_step)).model_dump(mode="json")


def store(session: Session, claim: Claim, given: JobInputs, done: Sequence[Any], now: datetime) -> None:
    """The gains, as the job's result."""
    session.get_one(Job, claim.job_id).result = {"sensors": dict(done[-1])}


def found(session: Session, job_id: int) -> tuple[Job, AddedSensorsDocument]:
    """A finished job with its result.

    Raises:
        NotFoundError: there is no such result.
    """
    job = job_requests.job(session, job_id)
    if job.building is None or "sensors" not in (job.result or {}):
        raise NotFoundError("comparison of new sensors", job_id)
    return job, AddedSensorsDocument.model_validate((job.result or {})["sensors"])


def latest(session: Session, building_id: int) -> Job | None:
    """The latest job of a building that is under way or has a result."""
    question = select(Job).where(Job.kind == SENSORS, Job.building_id == building_id, Job.refusal.is_(None))
    ended_well = Job.state.in_((*job_queue.UNDER_WAY, "done"))
    return session.scalars(question.where(ended_well).order_by(Job.id.desc()).limit(1)).first()
