"""Recipients that people add and change; each gets the messages about open alerts that it does not have."""

import base64
import secrets
from datetime import datetime

from sqlalchemy.orm import Session

from service.alerts.messages import send_open_alerts_to_new_recipients
from service.buildings import queries as building_queries, recipients
from service.buildings.recipient_rules import SECRET, SEVERITIES, ReceiverRule, wanted_kinds
from service.errors import ConflictError, FieldsError
from service.notify.schema import ReceiverChange, ReceiverRequest
from service.notify.tables import Receiver

NO_MAIL = (
    "no mail can be sent, as no mail server is set; set smtp.host, and smtp.port, smtp.security, smtp.user and "
    "smtp.password as the server needs them, and restart Menshin"
)


def add_recipient(
    session: Session, code: str, wanted: ReceiverRequest, by: str, now: datetime, *, can_mail: bool
) -> tuple[Receiver, str | None]:
    """Add a recipient to a building.

    Args:
        session: in which the recipient is added.
        code: of the building.
        wanted: the request.
        by: who adds it.
        now: the time.
        can_mail: whether a mail server is set; without one mail addresses are refused.

    Returns:
        The recipient, and the secret that was made for it, if any.

    Raises:
        NotFoundError: there is no such building.
        FieldsError: the name is in use, the address or the secret is not valid, or no mail can be sent.
    """
    if wanted.kind == "email" and not can_mail:
        raise FieldsError({"kind": NO_MAIL})
    building, _ = building_queries.building(session, code)
    made = _new_secret() if wanted.kind == "webhook" and wanted.secret is None else None
    rule = ReceiverRule(
        name=wanted.name,
        kind=wanted.kind,
        address=wanted.address,
        secret=wanted.secret or made,
        kinds=tuple(wanted.kinds or wanted_kinds(wanted.kind)),
        severities=tuple(wanted.severities or SEVERITIES),
        report=wanted.report,
        language=wanted.language,
    )
    row = recipients.add(session, building.id, rule, by, now)
    send_open_alerts_to_new_recipients(session, building.id, now)
    return row, made


def change_recipient(session: Session, receiver_id: int, wanted: ReceiverChange, now: datetime) -> Receiver:
    """Change what is given, and nothing else; send the messages about open alerts that the recipient has not received.

    Raises:
        NotFoundError: there is no such recipient.
        ConflictError: nothing is given, it is in the building file, or the address or the secret is not valid.
    """
    receiver = recipients.receiver(session, receiver_id)
    given = wanted.model_dump(exclude_none=True)
    if not given:
        raise ConflictError("The request changes nothing; give address, secret, kinds, severities, report or language.")
    of_now = {name: getattr(receiver, name) for name in ("name", "kind", "address", "secret", "kinds", "severities")}
    of_now |= {"report": receiver.with_report, "language": receiver.language}
    recipients.change(receiver, ReceiverRule(**(of_now | given)), now)
    send_open_alerts_to_new_recipients(session, receiver.building_id, now)
    return receiver


def _new_secret() -> str:
    """A key of Standard Webhooks of 256 random bits."""
    return SECRET + base64.b64encode(secrets.token_bytes(32)).decode()
