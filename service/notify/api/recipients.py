"""The API of recipients: add, change, remove and test them."""

import base64
import secrets
from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Body, Depends, Request, Response
from sqlalchemy.orm import Session

from service.access.auth import Caller, admin, caller, engineer
from service.alerts.messages import send_open_alerts_to_new_recipients
from service.buildings import queries as building_queries, recipients
from service.buildings.recipient_rules import SECRET, SEVERITIES, ReceiverRule, wanted_kinds
from service.errors import ConflictError, FieldsError
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
from service.notify.tables import Receiver

router = APIRouter(tags=["messages"], route_class=TaggedRoute)

ByAdmin = Annotated[Caller, Depends(admin)]
ByEngineer = Annotated[Caller, Depends(engineer)]
NO_MAIL = (
    "no mail can be sent, as no mail server is set; set smtp.host, and smtp.port, smtp.security, smtp.user and "
    "smtp.password as the server needs them, and restart Menshin"
)


@router.get("/buildings/{code}/receivers", operation_id="list_receivers", **responses(Receivers, 404))
def of_building(request: Request, code: Code, sessions: Reading) -> Receivers:
    """Recipients of the building's messages."""
    with sessions() as session:
        found, _ = building_queries.building(session, code)
        role = caller(request).role
        rows = [visible_to(role, receiver_out(row)) for row in recipients.of_building(session, found.id)]
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
        found, _ = building_queries.building(session, code)
        row, secret = add_recipient(session, found.id, wanted, by.name, datetime.now(UTC), can_mail=can_mail)
        answer = ReceiverMade(**receiver_out(row).model_dump(), secret=secret)
    response.headers["Location"] = f"/api/v1/receivers/{answer.id}"
    return answer


@router.get("/receivers/{receiver_id}", operation_id="get_receiver", **responses(ReceiverOut, 404))
def one(request: Request, receiver_id: ReceiverId, sessions: Reading) -> ReceiverOut:
    """A recipient."""
    with sessions() as session:
        answer = receiver_out(recipients.receiver(session, receiver_id))
    return visible_to(caller(request).role, answer)


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
        return receiver_out(
            change_recipient(session, recipients.receiver(session, receiver_id), wanted, datetime.now(UTC))
        )


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


def add_recipient(
    session: Session, building_id: int, wanted: ReceiverRequest, by: str, now: datetime, *, can_mail: bool
) -> tuple[Receiver, str | None]:
    """Add a recipient to a building.

    Args:
        session: in which the recipient is added.
        building_id: number of the building.
        wanted: the request.
        by: who adds it.
        now: the time.
        can_mail: whether a mail server is set; without one mail addresses are refused.

    Returns:
        The recipient, and the secret that was made for it, if any.

    Raises:
        FieldsError: the name is in use, the address or the secret is not valid, or no mail can be sent.
    """
    if wanted.kind == "email" and not can_mail:
        raise FieldsError({"kind": NO_MAIL})
    made = _new_secret() if wanted.kind == "webhook" and wanted.secret is None else None
    rule = ReceiverRule(
        name=wanted.name,
        kind=wanted.kind,
        address=wanted.address,
        secret=wanted.secret or made,
        kinds=tuple(wanted.kinds or wanted_kinds(wanted.kind)),
        severities=tuple(wanted.severities or SEVERITIES),
    )
    row = recipients.add(session, building_id, rule, by, now)
    send_open_alerts_to_new_recipients(session, building_id, now)
    return row, made


def change_recipient(session: Session, receiver: Receiver, wanted: ReceiverChange, now: datetime) -> Receiver:
    """Change what is given, and nothing else; send the messages about open alerts that the recipient has not received.

    Raises:
        ConflictError: nothing is given, it is in the building file, or the address or the secret is not valid.
    """
    given = wanted.model_dump(exclude_none=True)
    if not given:
        raise ConflictError("The request changes nothing; give address, secret, kinds or severities.")
    of_now = {name: getattr(receiver, name) for name in ("name", "kind", "address", "secret", "kinds", "severities")}
    recipients.change(receiver, ReceiverRule(**(of_now | given)), now)
    send_open_alerts_to_new_recipients(session, receiver.building_id, now)
    return receiver


def _new_secret() -> str:
    """A key of Standard Webhooks of 256 random bits."""
    return SECRET + base64.b64encode(secrets.token_bytes(32)).decode()
