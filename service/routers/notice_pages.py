"""The pages of who is told of a building, what they were told, and whether it arrived; no JavaScript."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response
from pydantic import ValidationError
from sqlalchemy.orm import Session
from starlette.responses import RedirectResponse

from service import receivers as told_of
from service.access.auth import Caller, Role, admin, engineer
from service.database import Message
from service.errors import ConflictError
from service.notices import claims, drill
from service.pages.rendering import page
from service.queries import told, watched
from service.receiver_rules import SEVERITIES, WANTED_KINDS
from service.routers.login import reader
from service.routers.model_pages import Form
from service.schemas.notices import DeliveryRow, ReceiverRequest
from service.web import notice_answers, receiver_requests
from service.web.parameters import Code, DeliveryId, MessageId, Reading, ReceiverId, Writing

router = APIRouter(include_in_schema=False)

Reader = Annotated[Caller, Depends(reader)]
ByAdmin = Annotated[Caller, Depends(admin)]
ByEngineer = Annotated[Caller, Depends(engineer)]
LATEST = 100
"""Messages that a building's page lists, sent or not."""


@router.get("/buildings/{code}/messages")
def of_building(request: Request, code: Code, sessions: Reading, by: Reader) -> Response:
    """Who is told of the building, and what became of the latest messages."""
    with sessions() as session:
        found, _ = watched.building(session, code)
        return page(
            request,
            "messages",
            can_mail=request.app.state.settings.smtp_host is not None,
            building=found,
            receivers=[
                notice_answers.seen_by(by.role, notice_answers.receiver(row))
                for row in told_of.of_building(session, found.id)
            ],
            messages=[
                (notice_answers.message_row(row), _deliveries(session, row, by))
                for row in told.messages(session, found.id, None, LATEST)
            ],
            kinds=WANTED_KINDS,
            severities=SEVERITIES,
            may_work=by.role >= Role.engineer,
            may_add=by.role >= Role.admin,
        )


@router.get("/messages/{message_id}")
def of_message(request: Request, message_id: MessageId, sessions: Reading, by: Reader) -> Response:
    """A message, and every attempt to deliver it."""
    with sessions() as session:
        row = told.message(session, message_id)
        return page(
            request,
            "message",
            building=row.building,
            message=notice_answers.message(session, row),
            deliveries=[
                notice_answers.seen_by(by.role, notice_answers.delivery(told.delivery(session, one.id)))
                for one in row.deliveries
            ],
            may_work=by.role >= Role.engineer,
        )


@router.post("/buildings/{code}/receivers")
def add(request: Request, code: Code, sessions: Writing, by: ByAdmin, form: Form) -> Response:
    """Let somebody be told of the building; a secret that was made is shown this once."""
    given: dict[str, object] = {name: value for name, value in form.items() if name in ("name", "kind", "address")}
    given |= {"secret": form.get("secret") or None}
    given |= {
        name: [value for value in values if f"{name}_{value}" in form] or None
        for name, values in (("kinds", WANTED_KINDS), ("severities", SEVERITIES))
    }
    try:
        wanted = ReceiverRequest.model_validate(given)
    except ValidationError as error:
        first = error.errors(include_input=False)[0]
        raise ConflictError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}.") from None
    can_mail = request.app.state.settings.smtp_host is not None
    with sessions.begin() as session:
        found, _ = watched.building(session, code)
        row, secret = receiver_requests.add(session, found.id, wanted, by.name, datetime.now(UTC), can_mail=can_mail)
        shown = notice_answers.receiver(row)
    if secret is not None:
        return page(request, "receiver_secret", 201, building=found, receiver=shown, secret=secret)
    return RedirectResponse(f"/buildings/{code}/messages", 303)


@router.post("/receivers/{receiver_id}/remove")
def remove(receiver_id: ReceiverId, sessions: Writing, _: ByAdmin) -> Response:
    """Tell a receiver no longer, and show who still is."""
    with sessions.begin() as session:
        row = told_of.receiver(session, receiver_id)
        told_of.remove_added(session, row, datetime.now(UTC))
        code = row.building.code
    return RedirectResponse(f"/buildings/{code}/messages", 303)


@router.post("/receivers/{receiver_id}/test")
def test(receiver_id: ReceiverId, sessions: Writing, by: ByEngineer) -> Response:
    """Send a test to a receiver, and show what becomes of it."""
    with sessions.begin() as session:
        message = drill.trial(session, told_of.receiver(session, receiver_id), by.name, datetime.now(UTC))
        number = message.id
    return RedirectResponse(f"/messages/{number}", 303)


@router.post("/buildings/{code}/drill")
def hold(code: Code, sessions: Writing, by: ByEngineer) -> Response:
    """Hold a drill, and show what becomes of it."""
    with sessions.begin() as session:
        found, _ = watched.building(session, code)
        number = drill.drill(session, found, by.name, datetime.now(UTC)).id
    return RedirectResponse(f"/messages/{number}", 303)


@router.post("/deliveries/{delivery_id}/replay")
def replay(delivery_id: DeliveryId, sessions: Writing, _: ByEngineer) -> Response:
    """Try a delivery again that was given up, and show what becomes of it."""
    with sessions.begin() as session:
        row = told.delivery(session, delivery_id)
        claims.replay(row, datetime.now(UTC))
        number = row.message_id
    return RedirectResponse(f"/messages/{number}", 303)


def _deliveries(session: Session, message: Message, by: Caller) -> list[DeliveryRow]:
    """To whom a message goes, as the reader may see it."""
    return [notice_answers.seen_by(by.role, one) for one in notice_answers.delivery_rows(session, message.deliveries)]
