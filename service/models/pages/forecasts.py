"""Page of a forecast, and the form that asks for one."""

from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from core.forecasting.response import Peak
from core.rounding import plain, with_std
from core.workbench.forecasting import named, written
from service.access.auth import Caller, engineer
from service.access.pages import reader
from service.buildings.store import described, zone
from service.errors import NotFoundError
from service.http.forms import PostedFiles, answered, posted_with_files
from service.http.guard import UPLOAD
from service.http.parameters import JobId, ModelId, Reading, Writing
from service.http.rendering import page
from service.jobs import requests as job_requests
from service.jobs.tables import Job
from service.models import answers, queries, requests, uploads
from service.models.api.kept_effects import knowing
from service.models.forecast_results import ForecastDocument, LimitOut, MarginOut, PeakOut
from service.models.pages.models import shown_model
from service.models.schema import ForecastForm
from service.models.uploads import MotionFile
from service.parsing.process import limits
from service.verdict.checks import Check, Level, Outcome
from service.verdict.texts import outcome, shown_unit

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(knowing(reader))]
By = Annotated[Caller, Depends(knowing(engineer))]
Forecasting = Annotated[PostedFiles[ForecastForm], Depends(posted_with_files(ForecastForm, UPLOAD))]


@dataclass(frozen=True, slots=True)
class PeakRow:
    """One peak."""

    name: str
    level: str
    direction: str
    value: str
    interval: str


@dataclass(frozen=True, slots=True)
class LimitRow:
    """One check."""

    title: str
    value: str
    margins: tuple[tuple[str, str, str], ...]
    """Level, limit and share of each limit."""
    outcome: str
    """In the language of the page."""
    reason: str
    """Why it is undecided; empty otherwise."""
    remedy: str


@router.get("/forecasts/{job_id}")
def of_forecast(request: Request, job_id: JobId, sessions: Reading, by: Reader) -> Response:
    """A forecast: warnings, the building's limits, and the response with its intervals."""
    with sessions() as session:
        job, found = _forecast(session, job_id)
        (model,) = answers.rows(session, [queries.version(session, job.model_id or 0)])
        building = queries.version(session, model.id).building
        return page(
            request,
            "forecast",
            building=building,
            zone=zone(session, building),
            model=model,
            job=job,
            found=found,
            forecast=found.forecasts[0],
            shown_limits=[limit_row(one) for one in found.forecasts[0].limits],
            shown_peaks=[peak_row(one) for one in found.forecasts[0].peaks],
        )


def _forecast(session: Session, job_id: int) -> tuple[Job, ForecastDocument]:
    job = job_requests.job(session, job_id)
    if job.model_id is None or "forecast" not in (job.result or {}):
        raise NotFoundError("forecast", job_id)
    return job, ForecastDocument.model_validate((job.result or {})["forecast"])


@router.post("/models/{model_id}/forecast")
def forecast(request: Request, model_id: ModelId, sessions: Writing, by: By, sent: Forecasting) -> Response:
    """Forecast the response to a stored earthquake or to an uploaded motion, and show the progress."""

    def act(wanted: ForecastForm) -> Response:
        if not sent.files:
            with sessions.begin() as session:
                number = requests.forecast(session, model_id, wanted.request, by.name, datetime.now(UTC)).id
            return RedirectResponse(f"/jobs/{number}", 303)
        file, scaling = uploads.one_file([MotionFile(one.name, one.data) for one in sent.files]), wanted.wanted_scaling
        with sessions() as session:
            building = described(session, queries.version(session, model_id).building)
        uploads.check(file, building, limits(request.app.state.settings))
        kept = uploads.kept(file, request.app.state.settings)
        with sessions.begin() as session:
            number = requests.forecast_uploaded(session, model_id, kept, scaling, by.name, datetime.now(UTC)).id
        return RedirectResponse(f"/jobs/{number}", 303)

    return answered("forecast", sent.form, act, lambda why: shown_model(request, model_id, sessions, by, refused=why))


def peak_row(one: PeakOut) -> PeakRow:
    """A peak as a row."""
    peak = Peak(
        quantity=one.quantity,  # type: ignore[arg-type]  # written by this program
        level=one.level,
        direction=one.direction,
        value=one.value or 0.0,
        low=one.low or 0.0,
        high=one.high or 0.0,
        by_values=one.by_values or 0.0,
        by_model=one.by_model or 0.0,
    )
    value, _, ends = written(peak).partition(" (95 %: ")
    interval = ends.rstrip(")").replace(" to ", " – ")
    return PeakRow(named(peak), one.level, one.direction, value, interval)


def limit_row(one: LimitOut) -> LimitRow:
    """A check as a row."""
    check = Check(name=one.check, outcome=Outcome(one.outcome), level=Level(one.leads_to), unit=one.unit)
    unit, factor = shown_unit(check)
    value = "" if one.value is None else with_std(factor * one.value, _scaled(one.uncertainty, factor), unit)
    margins = tuple(
        (margin.level, f"{plain(factor * (margin.limit or 0.0))} {unit}".rstrip(), _share(margin))
        for margin in one.margins
    )
    return LimitRow(one.title, value, margins, outcome(check), one.reason, one.remedy)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _share(margin: MarginOut) -> str:
    if margin.share is None:
        return ""
    share = f"{100 * margin.share:.0f} %"
    return share if margin.share_high is None else f"{share} ({100 * margin.share_high:.0f} %)"
