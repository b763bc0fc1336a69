"""The pages of a building's recipients and messages, and their forms; no JavaScript."""

from datetime import UTC, datetime
from typing import Annotated, get_args

from fastapi import APIRouter, Depends, Request, Response
from sqlalchemy.orm import Session, sessionmaker
from starlette.responses import RedirectResponse

from service.access.auth import Caller, Role, admin, engineer
from service.access.pages import reader
from service.alerts.recipients import add_recipient
from service.buildings import queries as building_queries, recipients, store as building_store
from service.buildings.recipient_rules import SEVERITIES, WANTED_KINDS, ReceiverKind
from service.http.forms import NOT_REFUSED, Posted, Refused, answered, posted
from service.http.parameters import Code, DeliveryId, MessageId, Reading, ReceiverId, Writing
from service.http.rendering import page
from service.notify import claims, drill, queries, texts
from service.notify.schema import (
    DeliveryRow,
    ReceiverForm,
    delivery_out,
    delivery_rows,
    message_out,
    message_row,
    receiver_out,
    visible_to,
)
from service.notify.tables import Message

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(reader)]
ByAdmin = Annotated[Caller, Depends(admin)]
ByEngineer = Annotated[Caller, Depends(engineer)]
Adding = Annotated[Posted[ReceiverForm], Depends(posted(ReceiverForm))]
LATEST = 100
"""Messages that a building's page lists, sent or not."""


@router.get("/buildings/{code}/messages")
def of_building(request: Request, code: Code, sessions: Reading, by: Reader) -> Response:
    """The recipients of the building, and the latest messages."""
    return _listed(request, code, sessions, by)


def _listed(
    request: Request, code: str, sessions: sessionmaker[Session], by: Caller, refused: Refused = NOT_REFUSED
) -> Response:
    """Recipients and messages of the building, with the form to add one if it was refused."""
    with sessions() as session:
        building, _ = building_queries.building(session, code)
        role = by.on(code).role
        return page(
            request,
            "messages",
            refused.status,
            refused=refused,
            can_mail=request.app.state.settings.smtp.host is not None,
            building=building,
            zone=building_store.zone(session, building),
            receivers=[visible_to(by, receiver_out(row)) for row in recipients.of_building(session, building.id)],
            states=texts.STATES,
            kind_names=texts.KINDS,
            messages=[
                (message_row(row), _deliveries(session, row, by))
                for row in queries.messages(session, building.id, None, LATEST)
            ],
            kinds=WANTED_KINDS,
            ways=get_args(ReceiverKind),
            severities=SEVERITIES,
            may_work=role >= Role.engineer,
            may_add=role >= Role.admin,
        )


@router.get("/messages/{message_id}")
def of_message(request: Request, message_id: MessageId, sessions: Reading, by: Reader) -> Response:
    """A message, and every attempt to deliver it."""
    with sessions() as session:
        row = queries.message(session, message_id)
        return page(
            request,
            "message",
            building=row.building,
            zone=building_store.zone(session, row.building),
            message=message_out(session, row),
            states=texts.STATES,
            outcomes=texts.OUTCOMES,
            orders=texts.ORDERS,
            severity_names=texts.SEVERITY_NAMES,
            deliveries=[visible_to(by, delivery_out(queries.delivery(session, one.id))) for one in row.deliveries],
            may_work=by.on(row.building.code).role >= Role.engineer,
        )


@router.post("/buildings/{code}/receivers")
def add(request: Request, code: Code, sessions: Writing, by: ByAdmin, form: Adding) -> Response:
    """Add a recipient; a secret that was made is shown this once."""
    can_mail = request.app.state.settings.smtp.host is not None

    def act(wanted: ReceiverForm) -> Response:
        with sessions.begin() as session:
            row, secret = add_recipient(session, code, wanted, by.name, datetime.now(UTC), can_mail=can_mail)
            building, shown = row.building, receiver_out(row)
        if secret is not None:
            return page(request, "receiver_secret", 201, building=building, receiver=shown, secret=secret)
        return RedirectResponse(f"/buildings/{code}/messages", 303)

    return answered("receiver", form, act, lambda refused: _listed(request, code, sessions, by, refused))


@router.post("/receivers/{receiver_id}/remove")
def remove(receiver_id: ReceiverId, sessions: Writing, _: ByAdmin) -> Response:
    """Remove a recipient, and show the others."""
    with sessions.begin() as session:
        row = recipients.receiver(session, receiver_id)
        recipients.remove_added(session, row, datetime.now(UTC))
        code = row.building.code
    return RedirectResponse(f"/buildings/{code}/messages", 303)


@router.post("/receivers/{receiver_id}/test")
def test(receiver_id: ReceiverId, sessions: Writing, by: ByEngineer) -> Response:
    """Send a test to a recipient, and show its delivery."""
    with sessions.begin() as session:
        message = drill.trial(session, recipients.receiver(session, receiver_id), by.name, datetime.now(UTC))
        number = message.id
    return RedirectResponse(f"/messages/{number}", 303)


@router.post("/buildings/{code}/drill")
def hold(code: Code, sessions: Writing, by: ByEngineer) -> Response:
    """Send a drill, and show its deliveries."""
    with sessions.begin() as session:
        building, _ = building_queries.building(session, code)
        number = drill.drill(session, building, by.name, datetime.now(UTC)).id
    return RedirectResponse(f"/messages/{number}", 303)


@router.post("/deliveries/{delivery_id}/replay")
def replay(delivery_id: DeliveryId, sessions: Writing, _: ByEngineer) -> Response:
    """Try a failed delivery again, and show its message."""
    with sessions.begin() as session:
        row = queries.delivery(session, delivery_id)
        claims.replay(row, datetime.now(UTC))
        number = row.message_id
    return RedirectResponse(f"/messages/{number}", 303)


def _deliveries(session: Session, message: Message, by: Caller) -> list[DeliveryRow]:
    """Deliveries of a message as the reader may see them."""
    return [visible_to(by, one) for one in delivery_rows(session, message.deliveries)]
