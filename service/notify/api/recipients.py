"""Receivers: who is told of a building, and whether the way to them works."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Request, Response

from service.access.auth import Caller, admin, caller, engineer
from service.buildings import queries as building_queries, recipients as told
from service.errors import documented
from service.http.parameters import Code, Reading, ReceiverId, Writing
from service.http.responses import document, responses
from service.models.api.models import making
from service.notify import answers, drill
from service.notify.api import requests
from service.notify.queries import delivery
from service.notify.schema import (
    DeliveryOut,
    ReceiverChange,
    ReceiverMade,
    ReceiverOut,
    ReceiverRequest,
    Receivers,
)

router = APIRouter(tags=["messages"])

ByAdmin = Annotated[Caller, Depends(admin)]
ByEngineer = Annotated[Caller, Depends(engineer)]


@router.get("/buildings/{code}/receivers", operation_id="list_receivers", **responses(Receivers, 404))
def of_building(request: Request, code: Code, sessions: Reading) -> Response:
    """Who is told of the building, and of what."""
    with sessions() as session:
        found, _ = building_queries.building(session, code)
        role = caller(request).role
        rows = [answers.seen_by(role, answers.receiver(row)) for row in told.of_building(session, found.id)]
    return document(request, Receivers(items=rows))


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
    wanted: Annotated[ReceiverRequest, Body(description="Who, where, and of what.")],
) -> ReceiverMade:
    """Let somebody be told of the building, at once of the alerts that are open; it takes an admin's key.

    For a webhook without a secret one is made, and answered this once. A mail address is refused while no mail server
    is set.
    """
    can_mail = request.app.state.settings.smtp.host is not None
    with sessions.begin() as session:
        found, _ = building_queries.building(session, code)
        row, secret = requests.add(session, found.id, wanted, by.name, datetime.now(UTC), can_mail=can_mail)
        answer = ReceiverMade(**answers.receiver(row).model_dump(), secret=secret)
    response.headers["Location"] = f"/api/v1/receivers/{answer.id}"
    return answer


@router.get("/receivers/{receiver_id}", operation_id="get_receiver", **responses(ReceiverOut, 404))
def one(request: Request, receiver_id: ReceiverId, sessions: Reading) -> Response:
    """A receiver."""
    with sessions() as session:
        answer = answers.receiver(told.receiver(session, receiver_id))
    return document(request, answers.seen_by(caller(request).role, answer))


@router.patch(
    "/receivers/{receiver_id}", operation_id="change_receiver", response_model=ReceiverOut, responses=making()
)
def change(
    receiver_id: ReceiverId,
    sessions: Writing,
    _: ByAdmin,
    wanted: Annotated[ReceiverChange, Body(description="What shall be otherwise.")],
) -> ReceiverOut:
    """Tell a receiver elsewhere, or of other things; it takes an admin's key. Those of the file are changed there.

    What is open and it has not heard of is sent to it.
    """
    with sessions.begin() as session:
        return answers.receiver(
            requests.change(session, told.receiver(session, receiver_id), wanted, datetime.now(UTC))
        )


@router.delete(
    "/receivers/{receiver_id}",
    operation_id="remove_receiver",
    status_code=204,
    responses=documented(401, 403, 404, 409, 422),
)
def remove(receiver_id: ReceiverId, sessions: Writing, _: ByAdmin) -> None:
    """Tell a receiver no longer; it takes an admin's key. What it was told stays in the log."""
    with sessions.begin() as session:
        told.remove_added(session, told.receiver(session, receiver_id), datetime.now(UTC))


@router.post(
    "/receivers/{receiver_id}/test",
    operation_id="test_receiver",
    status_code=202,
    response_model=DeliveryOut,
    responses=making(202),
)
def test(receiver_id: ReceiverId, sessions: Writing, response: Response, by: ByEngineer) -> DeliveryOut:
    """Send a message to this receiver alone that says it is a test, whatever it wants to hear of."""
    with sessions.begin() as session:
        message = drill.trial(session, told.receiver(session, receiver_id), by.name, datetime.now(UTC))
        answer = answers.delivery(delivery(session, message.deliveries[0].id))
    response.headers["Location"] = f"/api/v1/deliveries/{answer.id}"
    return answer
