"""What people ask of receivers, as rules that the building's receivers can be brought to."""

import base64
import secrets
from datetime import datetime

from sqlalchemy.orm import Session

from service.alerts.newcomers import tell_newcomers
from service.buildings import recipients
from service.buildings.recipient_rules import SECRET, SEVERITIES, ReceiverRule, wanted_kinds
from service.errors import ConflictError, FieldsError
from service.notify.schema import ReceiverChange, ReceiverRequest
from service.notify.tables import Receiver

NO_MAIL = (
    "no mail can be sent, as no mail server is set; set smtp.host, and smtp.port, smtp.security, smtp.user and "
    "smtp_password as the server needs them, and restart Menshin"
)


def new_secret() -> str:
    """A key of Standard Webhooks of 256 random bits."""
    return SECRET + base64.b64encode(secrets.token_bytes(32)).decode()


def add(
    session: Session, building_id: int, wanted: ReceiverRequest, by: str, now: datetime, *, can_mail: bool
) -> tuple[Receiver, str | None]:
    """Add a recipient to a building.

    Args:
        session: in which the recipient is added.
        building_id: number of the building.
        wanted: what is asked for.
        by: who asks.
        now: the time.
        can_mail: whether a mail server is set; without one a mail address is refused.

    Returns:
        The receiver, and the secret that was made for it, if one was.

    Raises:
        FieldsError: the name is taken, the address or the secret is not valid, or no mail can be sent.
    """
    if wanted.kind == "email" and not can_mail:
        raise FieldsError({"kind": NO_MAIL})
    made = new_secret() if wanted.kind == "webhook" and wanted.secret is None else None
    rule = ReceiverRule(
        name=wanted.name,
        kind=wanted.kind,
        address=wanted.address,
        secret=wanted.secret or made,
        kinds=tuple(wanted.kinds or wanted_kinds(wanted.kind)),
        severities=tuple(wanted.severities or SEVERITIES),
    )
    row = recipients.add(session, building_id, rule, by, now)
    tell_newcomers(session, building_id, now)
    return row, made


def change(session: Session, receiver: Receiver, wanted: ReceiverChange, now: datetime) -> Receiver:
    """Change what is asked for of a receiver, and nothing else; what is open and it has not heard of is sent to it.

    Raises:
        ConflictError: nothing is asked for, it is the file's, or the address or the secret will not do.
    """
    given = wanted.model_dump(exclude_none=True)
    if not given:
        raise ConflictError("Nothing is to be changed; address, secret, kinds or severities would do.")
    of_now = {name: getattr(receiver, name) for name in ("name", "kind", "address", "secret", "kinds", "severities")}
    recipients.change(receiver, ReceiverRule(**(of_now | given)), now)
    tell_newcomers(session, receiver.building_id, now)
    return receiver
