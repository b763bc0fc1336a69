"""Which kinds of work there are."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from types import MappingProxyType

from sqlalchemy.orm import Session

from core.analysis import EventAnalysis, analyse
from service import results
from service.database import Building, Event, Job, ModelVersion
from service.modelling import model_diagnoses, model_fits, model_results, model_work
from service.modelling.model_inputs import WorkInputs, diagnosis_inputs, work_inputs
from service.modelling.model_work import Comparison
from service.queue import jobs
from service.queue.jobs import ANALYSE, COMPARE, DIAGNOSE, EXTEND, FIT, WATCH, Claim
from service.queue.stages import Kind, Stage
from service.results import Inputs
from service.watching import monitoring


def _analysis_stages(inputs: Inputs) -> Sequence[Stage]:
    given = (inputs.segments, inputs.description, inputs.settings)
    return (Stage("Analysing the event", analyse, lambda _, tell: given),)


def _store_analysis(
    session: Session, claim: Claim, inputs: Inputs, found: Sequence[EventAnalysis], now: datetime
) -> None:
    event = session.get_one(Event, claim.event_id)
    session.get_one(Building, event.building_id, with_for_update={"key_share": True})  # first, as who reads a record
    analysis = results.store(session, claim, inputs, found[-1], now)
    session.flush()
    if analysis.current and analysis.refusal is None:
        model_results.follow(session, event, now)
    if analysis.current:
        jobs.enqueue_watch(session, event.building_id, None, now)


def _store_comparison(
    session: Session, claim: Claim, inputs: WorkInputs, found: Sequence[Comparison], now: datetime
) -> None:
    model_results.store_comparisons(session, inputs.model_id, found[-1].each, inputs.roles, now)
    session.get_one(Job, claim.job_id).result = {"fails": list(found[-1].fails)}
    model = session.get_one(ModelVersion, inputs.model_id)
    if model.state == "current":
        jobs.enqueue_watch(session, model.building_id, None, now)


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        ANALYSE: Kind(results.inputs, _analysis_stages, _store_analysis),
        COMPARE: Kind(work_inputs, model_work.stages, _store_comparison),
        FIT: Kind(work_inputs, model_fits.fit_stages, model_fits.store_fit),
        EXTEND: Kind(work_inputs, model_fits.extension_stages, model_fits.store_extension),
        DIAGNOSE: Kind(diagnosis_inputs, model_diagnoses.stages, model_diagnoses.store),
        WATCH: Kind(monitoring.inputs, monitoring.stages, monitoring.store),
    }
)
"""By the name that a job has."""
