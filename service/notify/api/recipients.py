"""The API of recipients: add, change, remove and test them."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Request, Response

from service.access.auth import Caller, admin, caller, engineer
from service.alerts.recipients import add_recipient, change_recipient
from service.buildings import queries as building_queries, recipients
from service.http.parameters import Code, Reading, ReceiverId, Writing
from service.http.problems import openapi_responses
from service.http.responses import TaggedRoute, responses
from service.models.api.models import making
from service.notify import drill
from service.notify.queries import delivery
from service.notify.schema import (
    DeliveryOut,
    ReceiverChange,
    ReceiverMade,
    ReceiverOut,
    ReceiverRequest,
    Receivers,
    delivery_out,
    receiver_out,
    visible_to,
)

router = APIRouter(tags=["messages"], route_class=TaggedRoute)

ByAdmin = Annotated[Caller, Depends(admin)]
ByEngineer = Annotated[Caller, Depends(engineer)]


@router.get("/buildings/{code}/receivers", operation_id="list_receivers", **responses(Receivers, 404))
def of_building(request: Request, code: Code, sessions: Reading) -> Receivers:
    """Recipients of the building's messages."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        rows = [visible_to(caller(request), receiver_out(row)) for row in recipients.of_building(session, building.id)]
    return Receivers(items=rows)


@router.post(
    "/buildings/{code}/receivers",
    operation_id="add_receiver",
    status_code=201,
    response_model=ReceiverMade,
    responses=making(201),
)
def add(
    request: Request,
    code: Code,
    sessions: Writing,
    response: Response,
    by: ByAdmin,
    wanted: Annotated[ReceiverRequest, Body(description="Name, address and subscriptions.")],
) -> ReceiverMade:
    """Add a recipient, and send it the messages about open alerts; needs an admin's key.

    For a webhook without a secret one is made and returned this once. Mail addresses are refused while no mail server
    is set.
    """
    can_mail = request.app.state.settings.smtp.host is not None
    with sessions.begin() as session:
        row, secret = add_recipient(session, code, wanted, by.name, datetime.now(UTC), can_mail=can_mail)
        answer = ReceiverMade(**receiver_out(row).model_dump(), secret=secret)
    response.headers["Location"] = f"/api/v1/receivers/{answer.id}"
    return answer


@router.get("/receivers/{receiver_id}", operation_id="get_receiver", **responses(ReceiverOut, 404))
def one(request: Request, receiver_id: ReceiverId, sessions: Reading) -> ReceiverOut:
    """A recipient."""
    with sessions() as session:
        answer = receiver_out(recipients.receiver(session, receiver_id))
    return visible_to(caller(request), answer)


@router.patch(
    "/receivers/{receiver_id}", operation_id="change_receiver", response_model=ReceiverOut, responses=making()
)
def change(
    receiver_id: ReceiverId,
    sessions: Writing,
    _: ByAdmin,
    wanted: Annotated[ReceiverChange, Body(description="The changes.")],
) -> ReceiverOut:
    """Change address or subscriptions; needs an admin's key. Recipients of the building file are changed there.

    Messages about open alerts that it has not received are sent to it.
    """
    with sessions.begin() as session:
        return receiver_out(change_recipient(session, receiver_id, wanted, datetime.now(UTC)))


@router.delete(
    "/receivers/{receiver_id}",
    operation_id="remove_receiver",
    status_code=204,
    responses=openapi_responses(401, 403, 404, 409, 422),
)
def remove(receiver_id: ReceiverId, sessions: Writing, _: ByAdmin) -> None:
    """Remove a recipient; needs an admin's key. Its deliveries stay in the log."""
    with sessions.begin() as session:
        recipients.remove_added(session, recipients.receiver(session, receiver_id), datetime.now(UTC))


@router.post(
    "/receivers/{receiver_id}/test",
    operation_id="test_receiver",
    status_code=202,
    response_model=DeliveryOut,
    responses=making(202),
)
def test(receiver_id: ReceiverId, sessions: Writing, response: Response, by: ByEngineer) -> DeliveryOut:
    """Send a test message to this recipient alone, whatever its subscriptions."""
    with sessions.begin() as session:
        message = drill.trial(session, recipients.receiver(session, receiver_id), by.name, datetime.now(UTC))
        answer = delivery_out(delivery(session, message.deliveries[0].id))
    response.headers["Location"] = f"/api/v1/deliveries/{answer.id}"
    return answer
