"""The page of a building: the verdict first, then everything that it rests on."""

from datetime import UTC, datetime, timedelta
from typing import Annotated
from zoneinfo import ZoneInfo

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from service.access.auth import Caller, Role
from service.access.pages import reader
from service.alerts import inspections, queries as alert_queries
from service.alerts.api import By
from service.alerts.operator_actions import person_name
from service.alerts.schema import BuildingInspectionForm
from service.analyses import added_sensors
from service.analyses.pages import MODES, View, viewed
from service.buildings import queries
from service.buildings.pages.section import section
from service.buildings.pages.summary import summarised
from service.buildings.pages.timeline import timeline
from service.buildings.store import described
from service.buildings.tables import Building
from service.db.select import Span
from service.http.forms import NOT_REFUSED, Posted, Refused, answered, posted
from service.http.parameters import Code, Reading, Writing
from service.http.rendering import page
from service.models import answers as model_answers, queries as model_queries
from service.models.schema import Trend
from service.models.tables import ModelVersion
from service.notify import queries as notify_queries
from service.records import queries as record_queries
from service.verdict import reading, texts

MESSAGES = 6
"""Messages that the page lists, the latest."""

router = APIRouter(include_in_schema=False)
Reader = Annotated[Caller, Depends(reader)]
Inspecting = Annotated[Posted[BuildingInspectionForm], Depends(posted(BuildingInspectionForm))]


@router.get("/buildings/{code}")
def of_building(request: Request, code: Code, sessions: Reading, by: Reader) -> Response:
    """A building: verdict, what to do, whom to call, and its last earthquake."""
    return shown_building(request, code, sessions, by)


def shown_building(
    request: Request, code: str, sessions: sessionmaker[Session], by: Caller, refused: Refused = NOT_REFUSED
) -> Response:
    """The page, with the form that was refused, if one was."""
    with sessions() as session:
        building, _ = queries.building(session, code)
        (standing,) = reading.standings(session, [building.id])
        return page(
            request,
            "building",
            refused.status,
            refused=refused,
            may_inspect=by.on(code).role >= Role.engineer,
            new_sensors=added_sensors.latest(session, building.id),
            results=texts.RESULTS,
            zone=standing.file.timezone,
            signed=inspections.inspections(session, building.id),
            building=building,
            summary=summarised(session, standing),
            section=section(session, standing),
            timeline=timeline(session, building, _tomorrow()),
            answers={one.id: one for one in alert_queries.of_numbers(session, [a.id for a in standing.verdict.alerts])},
            comments=alert_queries.last_comments(session, [a.id for a in standing.verdict.alerts]),
            messages=notify_queries.messages(session, building.id, None, MESSAGES),
            views=last_events(session, building),
            modes=MODES,
            models=failing_models(session, building),
        )


@router.post("/buildings/{code}/inspections")
def inspect(request: Request, code: Code, sessions: Writing, by: By, form: Inspecting) -> Response:
    """Record an inspection of the building, and show the building."""
    now, age = datetime.now(UTC), timedelta(seconds=request.app.state.settings.notify.max_event_age)

    def act(wanted: BuildingInspectionForm) -> Response:
        with sessions.begin() as session:
            building, _ = queries.building(session, code)
            at = wanted.inspected_at.replace(tzinfo=ZoneInfo(described(session, building).timezone))
            who = person_name(by, wanted.name)
            inspections.record(session, building, who, wanted.result, wanted.comment, at.astimezone(UTC), age, now)
        return RedirectResponse(f"/buildings/{code}", 303)

    return answered("inspection", form, act, lambda refused: shown_building(request, code, sessions, by, refused))


def _tomorrow() -> datetime:
    """The end of the day: the years end there, so that the page is the same until then."""
    return datetime.now(UTC).replace(hour=0, minute=0, second=0, microsecond=0) + timedelta(days=1)


def failing_models(session: Session, building: Building) -> list[tuple[ModelVersion, Trend]]:
    """The building's current models that miss its latest events."""
    in_force = model_queries.current_versions(session, building.id)
    compared = model_queries.latest_comparisons(session, [model.id for model in in_force])
    trends = [(model, model_answers.trend(model.id, compared[model.id])) for model in in_force]
    return [(model, trend) for model, trend in trends if trend.finding is not None]


def last_events(session: Session, building: Building) -> list[View]:
    """The last event, and where it has no result the last one that has."""
    last = [viewed(session, *pair) for pair in record_queries.events(session, building.id, Span(), None, None, limit=1)]
    if any(view.results for view in last):
        return last
    return last + [viewed(session, *pair) for pair in record_queries.last_analysed(session, building.id)]
