"""The API of alerts, of what engineers do about them, and of silences."""

from datetime import UTC, datetime, timedelta
from typing import Annotated, Literal

from fastapi import APIRouter, Body, Depends, Path, Query, Request, Response

from service.access.auth import Caller, engineer
from service.alerts import inspections, operator_actions, queries
from service.alerts.schema import (
    AcknowledgeRequest,
    AlertOut,
    Alerts,
    AssignRequest,
    BuildingInspectionOut,
    BuildingInspectionRequest,
    BuildingInspections,
    CommentRequest,
    InspectRequest,
    SilenceOut,
    SilenceRequest,
    Silences,
    alert_line,
    alert_out,
    inspection_out,
    silence_out,
)
from service.buildings import queries as building_queries
from service.http.paging import Before, Limit, page_by_number
from service.http.parameters import LARGEST, Code, Reading, Writing
from service.http.responses import TaggedRoute, responses, table_responses
from service.models.api.models import making

router = APIRouter(tags=["alerts"], route_class=TaggedRoute)

By = Annotated[Caller, Depends(engineer)]
AlertId = Annotated[int, Path(description="Number of the alert.", ge=1, le=LARGEST, examples=[1])]
SilenceId = Annotated[int, Path(description="Number of the silence.", ge=1, le=LARGEST, examples=[1])]
AnyBuilding = Annotated[
    str | None, Query(description="Only of the building of this code.", pattern=r"^[A-Za-z0-9_-]{1,32}$")
]
AnyState = Annotated[
    Literal["open", "pending", "on_hold", "active", "acknowledged", "resolved", "withdrawn"] | None,
    Query(description="Only alerts in this state; `open`: any that has not ended."),
]
AnyKind = Annotated[
    Literal["deterioration", "limit", "recovery", "sensor", "model", "data"] | None,
    Query(description="Only alerts of this kind."),
]


@router.get("/alerts", operation_id="list_alerts", **table_responses(Alerts, 404))
def every(
    sessions: Reading,
    building: AnyBuilding = None,
    state: AnyState = None,
    kind: AnyKind = None,
    cursor: Before = None,
    limit: Limit = 50,
) -> Alerts:
    """Alerts, the latest first; those that ended are kept."""
    with sessions() as session:
        of = None if building is None else building_queries.building(session, building)[0].id
        rows = [alert_line(one) for one in queries.every(session, of, state, kind, cursor, limit)]
    return page_by_number(Alerts, rows, limit)


@router.get("/alerts/{alert_id}", operation_id="get_alert", **responses(AlertOut, 404))
def one(alert_id: AlertId, sessions: Reading) -> AlertOut:
    """An alert with its evidence, every change of it, inspections and deliveries of its messages."""
    with sessions() as session:
        return alert_out(session, queries.alert(session, alert_id), datetime.now(UTC))


@router.post(
    "/alerts/{alert_id}/acknowledge",
    operation_id="acknowledge_alert",
    response_model=AlertOut,
    responses=making(),
)
def acknowledge(
    alert_id: AlertId,
    sessions: Writing,
    by: By,
    wanted: Annotated[AcknowledgeRequest, Body(description="A note, and the person's name.")],
) -> AlertOut:
    """Acknowledge an alert, so that others see who looks after it; an acknowledged alert stays with its person."""
    now = datetime.now(UTC)
    with sessions.begin() as session:
        alert = queries.alert(session, alert_id)
        operator_actions.acknowledge(session, alert, operator_actions.person_name(by, wanted.name), wanted.note, now)
        return alert_out(session, alert, now)


@router.post(
    "/alerts/{alert_id}/comments", operation_id="comment_on_alert", response_model=AlertOut, responses=making()
)
def comment(
    alert_id: AlertId,
    sessions: Writing,
    by: By,
    wanted: Annotated[CommentRequest, Body(description="The comment, and the person's name.")],
) -> AlertOut:
    """Comment on an alert, open or ended; a comment is never changed or removed."""
    now = datetime.now(UTC)
    with sessions.begin() as session:
        alert = queries.alert(session, alert_id)
        operator_actions.comment(session, alert, operator_actions.person_name(by, wanted.name), wanted.text, None, now)
        return alert_out(session, alert, now)


@router.post("/alerts/{alert_id}/assign", operation_id="assign_alert", response_model=AlertOut, responses=making())
def assign(
    alert_id: AlertId,
    sessions: Writing,
    by: By,
    wanted: Annotated[AssignRequest, Body(description="The person, a comment, and the sender's name.")],
) -> AlertOut:
    """Assign an open alert to a person, so that everyone sees who looks after it; it sends no message."""
    now = datetime.now(UTC)
    with sessions.begin() as session:
        alert = queries.alert(session, alert_id)
        operator_actions.comment(
            session, alert, operator_actions.person_name(by, wanted.name), wanted.text or "", wanted.to, now
        )
        return alert_out(session, alert, now)


@router.post("/alerts/{alert_id}/inspect", operation_id="inspect_alert", response_model=AlertOut, responses=making())
def inspect(
    request: Request,
    alert_id: AlertId,
    sessions: Writing,
    by: By,
    wanted: Annotated[InspectRequest, Body(description="Findings, and whether a new reference period begins.")],
) -> AlertOut:
    """End an alert by an inspection of the building, or by a review of its data.

    Nothing else ends a deterioration. What began before raises no new alert unless it gets worse. With
    `reference_from` a new reference period begins: later earthquakes are compared with the building as it is then.
    """
    now, age = datetime.now(UTC), timedelta(seconds=request.app.state.settings.notify.max_event_age)
    with sessions.begin() as session:
        alert, who = queries.alert(session, alert_id), operator_actions.person_name(by, wanted.name)
        operator_actions.inspect_and_notify(
            session, alert, who, wanted.outcome, wanted.note, wanted.reference_from, age, now
        )
        return alert_out(session, alert, now)


@router.get(
    "/buildings/{code}/inspections", operation_id="list_inspections", **table_responses(BuildingInspections, 404)
)
def building_inspections(code: Code, sessions: Reading) -> BuildingInspections:
    """Inspections of the building that people signed, the latest first; none is ever changed."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = [inspection_out(one, code) for one in inspections.inspections(session, building.id)]
    return BuildingInspections(items=rows, next=None)


@router.post(
    "/buildings/{code}/inspections",
    operation_id="record_inspection",
    status_code=201,
    response_model=BuildingInspectionOut,
    responses=making(201),
)
def record_inspection(
    request: Request,
    code: Code,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[BuildingInspectionRequest, Body(description="Result, findings, and when it was made.")],
) -> BuildingInspectionOut:
    """Record an inspection of the building, signed by the sender.

    With the result `fit` the limits that earlier earthquakes exceeded no longer decide the level; the verdict names the
    inspection and the automatic result. An inspection made before an earthquake does not cover it.
    """
    now, age = datetime.now(UTC), timedelta(seconds=request.app.state.settings.notify.max_event_age)
    with sessions.begin() as session:
        building, _ = building_queries.building(session, code)
        who, at = operator_actions.person_name(by, wanted.name), wanted.inspected_at or now
        made = inspections.record(session, building, who, wanted.result, wanted.comment, at, age, now)
        answer = inspection_out(made, code)
    response.headers["Location"] = f"/api/v1/buildings/{code}/inspections"
    return answer


@router.get("/buildings/{code}/silences", operation_id="list_silences", **table_responses(Silences, 404))
def silences(code: Code, sessions: Reading) -> Silences:
    """Silences of the building, the latest first; those that ended are kept."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        return Silences(items=[silence_out(one) for one in reversed(queries.silences(session, building.id))], next=None)


@router.post(
    "/buildings/{code}/silences",
    operation_id="make_silence",
    status_code=201,
    response_model=SilenceOut,
    responses=making(201),
)
def silence(
    code: Code,
    sessions: Writing,
    response: Response,
    by: By,
    wanted: Annotated[SilenceRequest, Body(description="The causes, the end and the reason.")],
) -> SilenceOut:
    """Send no messages about alerts of such causes for a while; they are stored and shown, and reported afterwards."""
    with sessions.begin() as session:
        now = datetime.now(UTC)
        building, _ = building_queries.building(session, code)
        made = operator_actions.silence(session, building, wanted.pattern, wanted.until, wanted.reason, by.name, now)
        answer = silence_out(made)
    response.headers["Location"] = f"/api/v1/buildings/{code}/silences"
    return answer


@router.post("/silences/{silence_id}/end", operation_id="end_silence", response_model=SilenceOut, responses=making())
def end(silence_id: SilenceId, sessions: Writing, by: By) -> SilenceOut:
    """End a silence now; one that has ended already stays as it was."""
    with sessions.begin() as session:
        row = queries.silence(session, silence_id)
        operator_actions.end_silence(row, by.name, datetime.now(UTC))
        return silence_out(row)
