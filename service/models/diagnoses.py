"""Diagnosis of a version by events, and its storage."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy.orm import Session

from core.workbench.earthquakes import Earthquakes
from service.jobs.queue import Claim
from service.jobs.stages import ReportStep, Stage
from service.jobs.tables import Job
from service.models.inputs import WorkInputs
from service.models.model_file import ModelFile
from service.models.tables import DiagnosisPicture, ModelDiagnosis, ModelVersion
from service.models.work import given, observing, records
from service.models.workbench.diagnosis_json import as_json
from service.models.workbench.work import diagnose
from service.version import VERSION


@dataclass(frozen=True, slots=True)
class Picture:
    """One of a diagnosis."""

    title: str
    caption: str
    svg: str


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """The result."""

    outcome: str
    sentences: tuple[str, ...]
    document: Mapping[str, Any]
    """All numbers, as JSON."""
    pictures: tuple[Picture, ...]


def diagnosis(model: ModelFile, parent: str, events: Earthquakes, report_step: ReportStep) -> Diagnosis:
    """Every effect that the model has not, added to it and fitted to the events.

    Raises:
        RecordError: no event is left to fit to.
        ModelError: a model's force grew beyond all bounds.
    """
    import vl_convert

    from service.models.workbench.page import diagnosis_figures
    from service.reports.charts import CONFIG

    found = diagnose(model, parent, events, report_step)
    drawn = tuple(
        Picture(one.title, one.caption, vl_convert.vegalite_to_svg(one.picture.to_dict(), config=CONFIG))
        for one in diagnosis_figures(found.result)
    )
    return Diagnosis(found.result.outcome, found.result.text, as_json(found), drawn)


def stages(inputs: WorkInputs) -> Sequence[Stage]:
    """Number of steps of a diagnosis: each event, then every effect."""
    return (
        *observing(inputs),
        Stage(
            "Asking every effect what it would explain",
            diagnosis,
            lambda seen, report_step: (given(inputs), f"model {inputs.model_id}", records(inputs, seen), report_step),
        ),
    )


def store(session: Session, claim: Claim, inputs: WorkInputs, found: Sequence[Any], now: datetime) -> None:
    """The diagnosis and its pictures, with what it was made from."""
    result: Diagnosis = found[-1]
    job, wanted = session.get_one(Job, claim.job_id), [one.held for one in inputs.events if one.held.is_wanted]
    kept = ModelDiagnosis(
        model_id=inputs.model_id,
        job_id=claim.job_id,
        revision_id=inputs.revision_id,
        author=job.asked_by or session.get_one(ModelVersion, inputs.model_id).author,
        created_at=now,
        version=VERSION,
        fitted=[one.event_id for one in wanted if not one.is_held_out],
        left_out=[one.event_id for one in wanted if one.is_held_out],
        analyses=[one.analysis_id for one in (*wanted, *(one.held for one in inputs.unusable))],
        outcome=result.outcome,
        sentences=list(result.sentences),
        document=dict(result.document),
        pictures=[DiagnosisPicture(title=one.title, caption=one.caption, svg=one.svg) for one in result.pictures],
    )
    session.add(kept)
    session.flush()
    job.result = {"diagnosis": kept.id}
