"""Alerts: what people should know, what was done about it, and what they are not to be told for a while."""

from datetime import UTC, datetime, timedelta
from typing import Annotated, Literal

from fastapi import APIRouter, Body, Depends, Path, Query, Request, Response

from service.access.auth import Caller, engineer
from service.alerts import answers, operator_actions, queries, requests
from service.alerts.schema import (
    AcknowledgeRequest,
    AlertLine,
    AlertOut,
    Alerts,
    InspectRequest,
    SilenceOut,
    SilenceRequest,
    Silences,
)
from service.buildings import queries as building_queries
from service.http.parameters import LARGEST, Before, Code, Limit, Reading, Writing, next_number
from service.http.responses import Format, document, responses, table, wants_csv
from service.models.api.models import making

router = APIRouter(tags=["alerts"])

By = Annotated[Caller, Depends(engineer)]
AlertId = Annotated[int, Path(description="Number of the alert.", ge=1, le=LARGEST, examples=[1])]
SilenceId = Annotated[int, Path(description="Number of the silence.", ge=1, le=LARGEST, examples=[1])]
AnyBuilding = Annotated[
    str | None, Query(description="Only of the building of this code.", pattern=r"^[A-Za-z0-9_-]{1,32}$")
]
AnyState = Annotated[
    Literal["open", "pending", "on_hold", "active", "acknowledged", "resolved", "withdrawn"] | None,
    Query(description="Only alerts in this state; `open`: those that have not ended."),
]
AnyKind = Annotated[
    Literal["deterioration", "recovery", "sensor", "model", "data"] | None,
    Query(description="Only alerts of this kind."),
]


@router.get("/alerts", operation_id="list_alerts", **responses(Alerts, 404, csv=True))
def every(
    request: Request,
    sessions: Reading,
    building: AnyBuilding = None,
    state: AnyState = None,
    kind: AnyKind = None,
    cursor: Before = None,
    limit: Limit = 50,
    format: Format = None,
) -> Response:
    """Alerts, the latest first; those that ended are kept."""
    with sessions() as session:
        of = None if building is None else building_queries.building(session, building)[0].id
        rows = [answers.row(one) for one in queries.every(session, of, state, kind, cursor, limit)]
    last = next_number([row.id for row in rows], limit)
    is_csv = wants_csv(request, format)
    lines = [answers.cells(one) if is_csv else tuple(one.model_dump().values()) for one in rows]
    return table(request, format, tuple(AlertLine.model_fields), lines, last)


@router.get("/alerts/{alert_id}", operation_id="get_alert", **responses(AlertOut, 404))
def one(request: Request, alert_id: AlertId, sessions: Reading) -> Response:
    """An alert: what it rests on, every change of it, what people found, and who was told."""
    with sessions() as session:
        answer = answers.whole(session, queries.alert(session, alert_id), datetime.now(UTC))
    return document(request, answer)


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
    wanted: Annotated[AcknowledgeRequest, Body(description="A note, and who it is.")],
) -> AlertOut:
    """Take an alert on, so that others see who looks after it; one that somebody has taken on stays theirs."""
    now = datetime.now(UTC)
    with sessions.begin() as session:
        found = queries.alert(session, alert_id)
        operator_actions.acknowledge(session, found, requests.person(by, wanted.name), wanted.note, now)
        return answers.whole(session, found, now)


@router.post("/alerts/{alert_id}/inspect", operation_id="inspect_alert", response_model=AlertOut, responses=making())
def inspect(
    request: Request,
    alert_id: AlertId,
    sessions: Writing,
    by: By,
    wanted: Annotated[InspectRequest, Body(description="What was found, and whether all is well from then on.")],
) -> AlertOut:
    """End an alert by what was found at the building, or by a review of its data.

    A deterioration ends in no other way. It does not come again for what began before, unless it gets worse. With
    `reference_from` a new reference period begins: what comes later is held against the building as it is then.
    """
    now, age = datetime.now(UTC), timedelta(seconds=request.app.state.settings.notify.max_event_age)
    with sessions.begin() as session:
        found, who = queries.alert(session, alert_id), requests.person(by, wanted.name)
        requests.inspect(session, found, who, wanted.outcome, wanted.note, wanted.reference_from, age, now)
        return answers.whole(session, found, now)


@router.get("/buildings/{code}/silences", operation_id="list_silences", **responses(Silences, 404, csv=True))
def silences(request: Request, code: Code, sessions: Reading, format: Format = None) -> Response:
    """Silences of the building, the latest first; those that ended are kept."""
    with sessions() as session:
        found, _ = building_queries.building(session, code)
        rows = [answers.silence_row(one) for one in reversed(queries.silences(session, found.id))]
    return table(request, format, tuple(SilenceOut.model_fields), [tuple(dict(one).values()) for one in rows], None)


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
    wanted: Annotated[SilenceRequest, Body(description="Which causes, until when, and why.")],
) -> SilenceOut:
    """Tell nobody of alerts of such causes for a while; they are kept and shown all the same, and told afterwards."""
    with sessions.begin() as session:
        now = datetime.now(UTC)
        made = requests.silence(session, code, wanted.pattern, wanted.until, wanted.reason, by.name, now)
        answer = answers.silence_row(made)
    response.headers["Location"] = f"/api/v1/buildings/{code}/silences"
    return answer


@router.post("/silences/{silence_id}/end", operation_id="end_silence", response_model=SilenceOut, responses=making())
def end(silence_id: SilenceId, sessions: Writing, by: By) -> SilenceOut:
    """Tell people again from now on; a silence that has ended stays as it was."""
    with sessions.begin() as session:
        found = queries.silence(session, silence_id)
        operator_actions.end_silence(found, by.name, datetime.now(UTC))
        return answers.silence_row(found)
