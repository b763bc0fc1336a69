"""The kinds of jobs: inputs, stages and storage of each."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from types import MappingProxyType

from sqlalchemy.orm import Session

from core.analysis import EventAnalysis, analyse
from service.analyses import added_sensors, store as analysis_store
from service.analyses.store import Inputs
from service.buildings.locking import locked
from service.drift import monitoring as drift_monitoring
from service.jobs import queue as job_queue
from service.jobs.queue import (
    ANALYSE,
    COMPARE,
    DIAGNOSE,
    EXTEND,
    FIT,
    FORECAST,
    IMPROVE,
    SENSORS,
    SKETCH,
    WATCH,
    Claim,
)
from service.jobs.stages import Kind, Stage
from service.jobs.tables import Job
from service.models import comparing, forecast_jobs, jobs as model_jobs, store as model_store
from service.models.comparing import Comparison
from service.models.inputs import WorkInputs, diagnosis_inputs, work_inputs
from service.models.kept_effects import knowing
from service.models.tables import ModelVersion
from service.records.tables import Event


def _analysis_stages(inputs: Inputs) -> Sequence[Stage]:
    given = (inputs.segments, inputs.description, inputs.settings)
    return (Stage("Analysing the event", analyse, lambda _, report_step: given, inputs.key),)


def _store_analysis(
    session: Session, claim: Claim, inputs: Inputs, results: Sequence[EventAnalysis], now: datetime
) -> None:
    event = session.get_one(Event, claim.event_id)
    locked(session, event.building_id)
    analysis = analysis_store.store(session, claim, inputs, results[-1], now)
    session.flush()
    if analysis.current and analysis.refusal is None:
        model_store.follow(session, event, now)
    if analysis.current:
        job_queue.enqueue_monitoring(session, event.building_id, None, now)


def _store_comparison(
    session: Session, claim: Claim, inputs: WorkInputs, results: Sequence[Comparison], now: datetime
) -> None:
    model = session.get_one(ModelVersion, inputs.model_id)
    if model.state == "current":  # first, because it locks the building, and the comparisons refer to events
        job_queue.enqueue_monitoring(session, model.building_id, None, now)
    model_store.add_comparisons(session, inputs.model_id, results[-1].each, inputs.roles, now)
    session.get_one(Job, claim.job_id).result = {"fails": list(results[-1].fails)}


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        ANALYSE: Kind(analysis_store.inputs, _analysis_stages, _store_analysis),
        COMPARE: knowing(Kind(work_inputs, comparing.stages, _store_comparison)),
        FIT: knowing(Kind(work_inputs, model_jobs.fit_stages, model_jobs.store_fit)),
        EXTEND: knowing(Kind(work_inputs, model_jobs.extension_stages, model_jobs.store_extension)),
        IMPROVE: knowing(Kind(work_inputs, model_jobs.improvement_stages, model_jobs.store_improvement)),
        DIAGNOSE: knowing(Kind(diagnosis_inputs, model_jobs.diagnosis_stages, model_jobs.store_diagnosis)),
        SKETCH: knowing(Kind(work_inputs, model_jobs.sketch_stages, model_jobs.store_sketch)),
        FORECAST: knowing(Kind(forecast_jobs.inputs, forecast_jobs.stages, forecast_jobs.store)),
        SENSORS: Kind(added_sensors.inputs, added_sensors.stages, added_sensors.store),
        WATCH: Kind(drift_monitoring.inputs, drift_monitoring.stages, drift_monitoring.store),
    }
)
"""Kinds of jobs by name."""
