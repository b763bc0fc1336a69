"""Who is told of a building: those of its file, and those that people add; none is ever deleted."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.buildings.recipient_rules import VARIABLE, ReceiverRule, shown_address, wrong_address, wrong_secret
from service.errors import ConflictError, FieldsError, NotFoundError
from service.notify.tables import Delivery, Receiver

FILE, API = "file", "api"


def follow_file(session: Session, building_id: int, rules: Sequence[ReceiverRule], now: datetime) -> None:
    """Bring a building's receivers to what its file says; what people added under the same names is the file's now."""
    named = {rule.name for rule in rules}
    for receiver in of_building(session, building_id):
        if receiver.origin == FILE and receiver.name not in named:
            remove(session, receiver, now)
    for rule in rules:
        _put(session, building_id, rule, FILE, None, now)


def add(session: Session, building_id: int, rule: ReceiverRule, by: str, now: datetime) -> Receiver:
    """Let somebody be told of a building.

    Raises:
        ConflictError: the name is taken, or the address or the secret will not do.
    """
    if any(receiver.name == rule.name for receiver in of_building(session, building_id)):
        raise FieldsError({"name": f"there is a receiver {rule.name!r} already; give another name"})
    _refuse_wrong(rule)
    return _put(session, building_id, rule, API, by, now)


def change(receiver: Receiver, rule: ReceiverRule, now: datetime) -> Receiver:
    """Tell a receiver elsewhere, or of other things; what waits for it goes where it is now.

    Raises:
        ConflictError: it is the file's, or the address or the secret will not do.
    """
    _refuse_the_files(receiver)
    _refuse_wrong(rule)
    return _set(receiver, rule, now)


def remove_added(session: Session, receiver: Receiver, now: datetime) -> None:
    """Tell somebody no longer whom people added.

    Raises:
        ConflictError: it is the file's.
    """
    _refuse_the_files(receiver)
    remove(session, receiver, now)


def remove(session: Session, receiver: Receiver, now: datetime) -> None:
    """Tell somebody no longer; what still waits for it is dropped, and its log stays."""
    receiver.removed_at = now
    waiting = (Delivery.receiver_id == receiver.id, Delivery.state == "waiting")
    session.execute(update(Delivery).where(*waiting).values(state="dropped", finished_at=now))


def of_building(session: Session, building_id: int) -> Sequence[Receiver]:
    """Those who are told of a building."""
    there = (Receiver.building_id == building_id, Receiver.removed_at.is_(None))
    return session.scalars(select(Receiver).where(*there).order_by(Receiver.id)).all()


def receiver(session: Session, identity: int) -> Receiver:
    """One of them.

    Raises:
        NotFoundError: there is none by that number, or it is no longer told.
    """
    found = session.get(Receiver, identity)
    if found is None or found.removed_at is not None:
        raise NotFoundError("receiver", identity)
    return found


def without_secrets(text: str, rules: Sequence[ReceiverRule]) -> str:
    """A building file as it may be shown."""
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
    """Of what comes by the API; the environment of the service is not its to read."""
    given = {"address": rule.address, "secret": rule.secret}
    problems = {
        "address": wrong_address(rule.kind, rule.address),
        "secret": wrong_secret(rule.kind, rule.secret),
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
    """Of one name there is one row, so that its log goes on when it comes back."""
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
    row.kinds, row.severities = list(rule.kinds), list(rule.severities)
    return row
