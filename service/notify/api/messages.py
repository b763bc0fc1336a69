"""The API of messages, drills and deliveries."""

from collections.abc import AsyncIterator
from datetime import UTC, datetime
from functools import partial
from typing import Annotated, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.sse import EventSourceResponse
from sqlalchemy.orm import Session, sessionmaker

from service.access.auth import Caller, caller, engineer
from service.buildings import queries as building_queries
from service.http.paging import Before, Limit, page_by_number
from service.http.parameters import LARGEST, Code, DeliveryId, MessageId, Reading, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, responses, table_responses
from service.http.server_sent_events import followed
from service.models.api.models import making
from service.notify import claims, drill, queries
from service.notify.schema import (
    Deliveries,
    DeliveryOut,
    MessageOut,
    Messages,
    delivery_out,
    delivery_rows,
    message_out,
    message_row,
    visible_to,
)

router = APIRouter(tags=["messages"], route_class=TaggedRoute)

By = Annotated[Caller, Depends(engineer)]
OfBuilding = Annotated[
    str | None, Query(description="Only deliveries of this building.", pattern=r"^[A-Za-z0-9_-]{1,32}$")
]
OfReceiver = Annotated[int | None, Query(description="Only deliveries to this recipient.", ge=1, le=LARGEST)]
State = Annotated[
    Literal["waiting", "sending", "delivered", "failed", "dropped"] | None,
    Query(description="Only deliveries in this state."),
]


@router.get("/buildings/{code}/messages", operation_id="list_messages", **table_responses(Messages, 404))
def messages(code: Code, sessions: Reading, cursor: Before = None, limit: Limit = 50) -> Messages:
    """Messages about the building, the latest first."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = [message_row(row) for row in queries.messages(session, building.id, cursor, limit)]
    return page_by_number(Messages, rows, limit)


@router.get("/messages/{message_id}", operation_id="get_message", **responses(MessageOut, 404))
def message(request: Request, message_id: MessageId, sessions: Reading) -> MessageOut:
    """A message with its deliveries."""
    with sessions() as session:
        answer = message_out(session, queries.message(session, message_id))
    return visible_to(caller(request), answer)


def existing(message_id: MessageId, sessions: Reading) -> int:
    """Number of an existing message, checked before the stream begins."""
    with sessions() as session:
        return queries.message(session, message_id).id


@router.get(
    "/messages/{message_id}/progress",
    operation_id="follow_message",
    response_class=EventSourceResponse,
    responses=openapi_responses(401, 403, 404, 422),
)
async def progress(
    request: Request, identity: Annotated[int, Depends(existing)], sessions: Reading
) -> AsyncIterator[MessageOut]:
    """The message as server-sent events: as it is, then whenever a delivery changes, until none is under way.

    A stream without news for long ends too, and so does one whose key was revoked; browsers reconnect.
    """
    async for message in followed(request, partial(_answered, sessions, identity), _has_arrived):
        yield message


def _answered(sessions: sessionmaker[Session], identity: int) -> MessageOut:
    with sessions() as session:
        return message_out(session, queries.message(session, identity))


def _has_arrived(message: MessageOut) -> bool:
    return all(delivery.state not in claims.OPEN for delivery in message.deliveries)


@router.post(
    "/buildings/{code}/drill",
    operation_id="hold_drill",
    status_code=202,
    response_model=MessageOut,
    responses=making(202),
)
def hold(code: Code, sessions: Writing, response: Response, by: By) -> MessageOut:
    """Send a drill to all recipients of the building that are subscribed to drills: an alarm marked as not real."""
    with sessions.begin() as session:
        building, _ = building_queries.building(session, code)
        row = drill.drill(session, building, by.name, datetime.now(UTC))
        answer = message_out(session, queries.message(session, row.id))
    response.headers["Location"] = f"/api/v1/messages/{answer.id}"
    return answer


@router.get("/deliveries", operation_id="list_deliveries", **table_responses(Deliveries))
def deliveries(
    request: Request,
    sessions: Reading,
    building: OfBuilding = None,
    receiver: OfReceiver = None,
    state: State = None,
    cursor: Before = None,
    limit: Limit = 50,
) -> Deliveries:
    """Deliveries of messages to recipients, the latest first."""
    with sessions() as session:
        listed = queries.deliveries(session, building, receiver, state, cursor, limit)
        rows = [visible_to(caller(request), row) for row in delivery_rows(session, listed)]
    return page_by_number(Deliveries, rows, limit)


@router.get("/deliveries/{delivery_id}", operation_id="get_delivery", **responses(DeliveryOut, 404))
def delivery(request: Request, delivery_id: DeliveryId, sessions: Reading) -> DeliveryOut:
    """A delivery with every attempt: time, answer of the recipient, duration."""
    with sessions() as session:
        answer = delivery_out(queries.delivery(session, delivery_id))
    return visible_to(caller(request), answer)


@router.post(
    "/deliveries/{delivery_id}/replay",
    operation_id="replay_delivery",
    status_code=202,
    response_model=DeliveryOut,
    responses=making(202),
)
def replay(delivery_id: DeliveryId, sessions: Writing, response: Response, _: By) -> DeliveryOut:
    """Try a failed delivery again, as often as a new one; 409 unless it has failed."""
    with sessions.begin() as session:
        row = queries.delivery(session, delivery_id)
        claims.replay(row, datetime.now(UTC))
        answer = delivery_out(row)
    response.headers["Location"] = f"/api/v1/deliveries/{answer.id}"
    return answer
