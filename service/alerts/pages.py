"""The pages of the alerts and their forms; no JavaScript."""

from datetime import UTC, datetime, timedelta
from typing import Annotated, Any
from zoneinfo import ZoneInfo

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from core.drift.alarms import printed_change
from core.drift.quantities import quantity
from service.access.auth import Caller, Role
from service.access.pages import reader
from service.alerts import operator_actions, queries, texts
from service.alerts.api import AlertId, By, SilenceId
from service.alerts.schema import (
    AcknowledgeRequest,
    AssignRequest,
    CommentRequest,
    InspectForm,
    PartOut,
    SilenceForm,
    alert_out,
)
from service.alerts.tables import Alert
from service.analyses import queries as analysis_queries
from service.analyses.tables import DirectionResult
from service.buildings import queries as building_queries
from service.buildings.store import described
from service.buildings.tables import Building
from service.http.forms import NOT_REFUSED, Posted, Refused, answered, posted
from service.http.parameters import Code, Reading, Writing
from service.http.rendering import page
from service.records import queries as record_queries
from service.verdict import reading
from service.verdict.texts import STATE_NAMES

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(reader)]
LISTED = 200
"""The latest alerts of a building, of which its page lists the ended ones; it lists every open one."""
Acknowledging = Annotated[Posted[AcknowledgeRequest], Depends(posted(AcknowledgeRequest))]
Inspecting = Annotated[Posted[InspectForm], Depends(posted(InspectForm))]
Commenting = Annotated[Posted[CommentRequest], Depends(posted(CommentRequest))]
Assigning = Annotated[Posted[AssignRequest], Depends(posted(AssignRequest))]
Silencing = Annotated[Posted[SilenceForm], Depends(posted(SilenceForm))]


@router.get("/buildings/{code}/alerts")
def of_building(request: Request, code: Code, sessions: Reading, by: Reader) -> Response:
    """The building's alerts, those that have not ended first, and its silences."""
    return _listed(request, code, sessions, by)


def _listed(
    request: Request, code: str, sessions: sessionmaker[Session], by: Caller, refused: Refused = NOT_REFUSED
) -> Response:
    """The building's alerts, with a form of the page that was refused."""
    now = datetime.now(UTC)
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        open_alerts = queries.every(session, building.id, "open", None, None, None)
        latest = queries.every(session, building.id, None, None, None, LISTED)
        ended = [one for one in latest if one.closed_at is not None]
        rows = [*open_alerts, *ended]
        return page(
            request,
            "alerts",
            refused.status,
            refused=refused,
            building=building,
            verdict_on=reading.of_building(session, building),
            open_alerts=open_alerts,
            ended=ended,
            most=LISTED if len(latest) == LISTED else None,
            silences=[one for one in reversed(queries.silences(session, building.id)) if one.ends_at > now],
            comments=queries.comment_counts(session, [one.id for one in rows]),
            causes=sorted({one.cause for one in rows}),
            may_work=by.on(code).role >= Role.engineer,
            **_words(session, building),
        )


@router.get("/alerts/{alert_id}")
def of_alert(request: Request, alert_id: AlertId, sessions: Reading, by: Reader) -> Response:
    """An alert: what happened, its evidence, history and messages, and what can be done about it."""
    return _shown(request, alert_id, sessions, by)


def _shown(
    request: Request, alert_id: int, sessions: sessionmaker[Session], by: Caller, refused: Refused = NOT_REFUSED
) -> Response:
    """An alert, with a form of the page that was refused."""
    now = datetime.now(UTC)
    with sessions() as session:
        alert = queries.alert(session, alert_id)
        file = described(session, alert.building)
        zone = ZoneInfo(file.timezone)
        return page(
            request,
            "alert",
            refused.status,
            refused=refused,
            consequences=operator_actions.reference_consequences(session, alert, zone),
            building=alert.building,
            alert=alert_out(session, alert, now),
            results=_results(session, alert),
            contacts=file.contacts,
            may_work=by.on(alert.building.code).role >= Role.engineer,
            **_words(session, alert.building),
        )


@router.post("/alerts/{alert_id}/acknowledge")
def acknowledge(request: Request, alert_id: AlertId, sessions: Writing, by: By, form: Acknowledging) -> Response:
    """Acknowledge the alert, and show it."""

    def act(wanted: AcknowledgeRequest) -> Response:
        with sessions.begin() as session:
            alert, who = queries.alert(session, alert_id), operator_actions.person_name(by, wanted.name)
            operator_actions.acknowledge(session, alert, who, wanted.note, datetime.now(UTC))
        return RedirectResponse(f"/alerts/{alert_id}", 303)

    return answered("acknowledge", form, act, lambda refused: _shown(request, alert_id, sessions, by, refused))


@router.post("/alerts/{alert_id}/comments")
def comment(request: Request, alert_id: AlertId, sessions: Writing, by: By, form: Commenting) -> Response:
    """Comment on the alert, and show it."""

    def act(wanted: CommentRequest) -> Response:
        with sessions.begin() as session:
            alert, who = queries.alert(session, alert_id), operator_actions.person_name(by, wanted.name)
            operator_actions.comment(session, alert, who, wanted.text, None, datetime.now(UTC))
        return RedirectResponse(f"/alerts/{alert_id}", 303)

    return answered("comment", form, act, lambda refused: _shown(request, alert_id, sessions, by, refused))


@router.post("/alerts/{alert_id}/assign")
def assign(request: Request, alert_id: AlertId, sessions: Writing, by: By, form: Assigning) -> Response:
    """Assign the alert to a person, and show it."""

    def act(wanted: AssignRequest) -> Response:
        with sessions.begin() as session:
            alert, who = queries.alert(session, alert_id), operator_actions.person_name(by, wanted.name)
            operator_actions.comment(session, alert, who, wanted.text or "", wanted.to, datetime.now(UTC))
        return RedirectResponse(f"/alerts/{alert_id}", 303)

    return answered("assign", form, act, lambda refused: _shown(request, alert_id, sessions, by, refused))


@router.post("/alerts/{alert_id}/inspect")
def inspect(request: Request, alert_id: AlertId, sessions: Writing, by: By, form: Inspecting) -> Response:
    """End the alert by an inspection, and show it."""
    now, age = datetime.now(UTC), timedelta(seconds=request.app.state.settings.notify.max_event_age)

    def act(wanted: InspectForm) -> Response:
        with sessions.begin() as session:
            alert, who = queries.alert(session, alert_id), operator_actions.person_name(by, wanted.name)
            begins = operator_actions.reference_from(alert, wanted.reference, now)
            operator_actions.inspect_and_notify(session, alert, who, wanted.outcome, wanted.note, begins, age, now)
        return RedirectResponse(f"/alerts/{alert_id}", 303)

    return answered("inspect", form, act, lambda refused: _shown(request, alert_id, sessions, by, refused))


@router.post("/buildings/{code}/silences")
def silence(request: Request, code: Code, sessions: Writing, by: By, form: Silencing) -> Response:
    """Silence some alerts for a while, and show all alerts."""
    now = datetime.now(UTC)

    def act(wanted: SilenceForm) -> Response:
        until = (now + timedelta(hours=wanted.hours)).replace(microsecond=0)
        with sessions.begin() as session:
            building, _ = building_queries.building(session, code)
            operator_actions.silence(session, building, wanted.pattern, until, wanted.reason, by.name, now)
        return RedirectResponse(f"/buildings/{code}/alerts", 303)

    return answered("silence", form, act, lambda refused: _listed(request, code, sessions, by, refused))


@router.post("/silences/{silence_id}/end")
def end(silence_id: SilenceId, sessions: Writing, by: By) -> Response:
    """End a silence, and show the alerts."""
    with sessions.begin() as session:
        row = queries.silence(session, silence_id)
        operator_actions.end_silence(row, by.name, datetime.now(UTC))
        code = row.building.code
    return RedirectResponse(f"/buildings/{code}/alerts", 303)


def _words(session: Session, building: Building) -> dict[str, Any]:
    """Functions for times, causes and states on a page of the building."""
    zone = ZoneInfo(described(session, building).timezone)
    return {
        "span": lambda first, last: texts.time_span(first.astimezone(zone), last.astimezone(zone)),
        "of": texts.subject,
        "size": _size,
        "when": lambda moment: texts.local_time(moment.astimezone(zone)),
        "about": texts.cause,
        "meanings": texts.STATE_MEANINGS,
        "names": STATE_NAMES,
    }


def _results(session: Session, alert: Alert) -> list[DirectionResult]:
    """Results of the event that raised it in the direction that it is about; in all directions if it is about none."""
    if alert.raised_event_id is None:
        return []
    analyses = [one for one in record_queries.analyses(session, alert.raised_event_id) if one.current]
    results = [one for analysis in analyses for one in analysis_queries.direction_results(session, analysis.id)]
    measured = [one for one in results if one.peak_displacement is not None]
    return [one for one in measured if one.direction in alert.cause.split("/")] or measured


def _size(cause: str, part: PartOut) -> str:
    """Change of a part with its 95 % interval; empty if it is not known."""
    name = texts.quantity_of(cause)
    if name is None or part.drift is None or part.low is None or part.high is None:
        return ""
    return printed_change(quantity(name), part.drift, part.low, part.high)
