"""Recipients of a building's messages: those of its file, and those added through the API; none is ever deleted."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.buildings.recipient_rules import (
    VARIABLE,
    ReceiverRule,
    shown_address,
    wrong_address,
    wrong_language,
    wrong_report,
    wrong_secret,
)
from service.errors import ConflictError, FieldsError, NotFoundError
from service.notify.tables import Delivery, Receiver

FILE, API = "file", "api"


def follow_file(session: Session, building_id: int, rules: Sequence[ReceiverRule], now: datetime) -> None:
    """Bring a building's recipients in line with its file; an added one of the same name belongs to the file then."""
    named = {rule.name for rule in rules}
    for receiver in of_building(session, building_id):
        if receiver.origin == FILE and receiver.name not in named:
            remove(session, receiver, now)
    for rule in rules:
        _put(session, building_id, rule, FILE, None, now)


def add(session: Session, building_id: int, rule: ReceiverRule, by: str, now: datetime) -> Receiver:
    """Add a recipient.

    Raises:
        FieldsError: the name is in use, or the address, the secret or another value is not valid.
    """
    if any(receiver.name == rule.name for receiver in of_building(session, building_id)):
        raise FieldsError({"name": f"there is a receiver {rule.name!r} already; give another name"})
    _refuse_wrong(rule)
    return _put(session, building_id, rule, API, by, now)


def change(receiver: Receiver, rule: ReceiverRule, now: datetime) -> Receiver:
    """Change address or subscriptions; waiting messages go to the new address.

    Raises:
        ConflictError: it is in the building file.
        FieldsError: the address, the secret or another value is not valid.
    """
    _refuse_the_files(receiver)
    _refuse_wrong(rule)
    return _set(receiver, rule, now)


def remove_added(session: Session, receiver: Receiver, now: datetime) -> None:
    """Remove a recipient that was added through the API.

    Raises:
        ConflictError: it is in the building file.
    """
    _refuse_the_files(receiver)
    remove(session, receiver, now)


def remove(session: Session, receiver: Receiver, now: datetime) -> None:
    """Remove a recipient; its waiting deliveries are dropped, and its log stays."""
    receiver.removed_at = now
    waiting = (Delivery.receiver_id == receiver.id, Delivery.state == "waiting")
    session.execute(update(Delivery).where(*waiting).values(state="dropped", finished_at=now))


def of_building(session: Session, building_id: int) -> Sequence[Receiver]:
    """Current recipients of a building."""
    there = (Receiver.building_id == building_id, Receiver.removed_at.is_(None))
    return session.scalars(select(Receiver).where(*there).order_by(Receiver.id)).all()


def receiver(session: Session, identity: int) -> Receiver:
    """A recipient.

    Raises:
        NotFoundError: there is none with that number, or it was removed.
    """
    row = session.get(Receiver, identity)
    if row is None or row.removed_at is not None:
        raise NotFoundError("receiver", identity)
    return row


def without_secrets(text: str, rules: Sequence[ReceiverRule]) -> str:
    """A building file without secrets."""
    for rule in rules:
        shown = shown_address(rule.kind, rule.address)
        for secret, instead in ((rule.secret, "…"), (rule.address, shown)):
            if secret is not None and not secret.startswith(VARIABLE):
                text = text.replace(secret, instead)
    return text


def _refuse_the_files(receiver: Receiver) -> None:
    if receiver.origin == FILE:
        raise ConflictError(f"Receiver {receiver.name!r} is in the building file; it is changed or removed there.")


def _refuse_wrong(rule: ReceiverRule) -> None:
    """Refuse invalid values of a request, which may not read the environment of the service."""
    given = {"address": rule.address, "secret": rule.secret}
    problems = {
        "address": wrong_address(rule.kind, rule.address),
        "secret": wrong_secret(rule.kind, rule.secret),
        "report": wrong_report(rule.kind, rule.report),
        "language": wrong_language(rule.kind, rule.language),
    } | {
        name: "only the building file may name a variable of the environment"
        for name, value in given.items()
        if value is not None and value.startswith(VARIABLE)
    }
    if wrong := {name: problem for name, problem in problems.items() if problem}:
        raise FieldsError(wrong)


def _put(
    session: Session, building_id: int, rule: ReceiverRule, origin: str, by: str | None, now: datetime
) -> Receiver:
    """There is one row per name, so that its log continues when it is added again."""
    same = (Receiver.building_id == building_id, Receiver.name == rule.name)
    row = session.scalars(select(Receiver).where(*same)).one_or_none()
    if row is None:
        row = Receiver(building_id=building_id, name=rule.name, created_at=now)
        session.add(row)
    elif row.removed_at is not None:
        row.since = now
    row.origin, row.created_by, row.removed_at = origin, by, None
    _set(row, rule, now)
    session.flush()
    return row


def _set(row: Receiver, rule: ReceiverRule, now: datetime) -> Receiver:
    if row.id is not None and row.address != rule.address:
        row.since = now
    row.kind, row.address, row.secret = rule.kind, rule.address, rule.secret
    row.kinds, row.severities, row.with_report = list(rule.kinds), list(rule.severities), rule.report
    row.language = rule.language
    return row
