"""The audit trail: each session through which a person writes adds an entry as it commits.

The entry is part of the transaction of the change: neither exists without the other. A request that changes nothing,
because it repeats an earlier one, adds no entry.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any
from urllib.parse import urlsplit

from sqlalchemy import event, select
from sqlalchemy.orm import ORMExecuteState, Session, sessionmaker

from service.access.tables import AuditEntry
from service.db.select import latest

CONTEXT, CLOCK, CHANGED = "audit_context", "clock", "changed"
"""Keys of a session's `info`."""
SECRET = re.compile(r"secret|password|token|key|authorization", re.IGNORECASE)
"""Names whose values are hidden in the trail."""
ADDRESS_KEY = re.compile(r"address|mail|location", re.IGNORECASE)
"""Names whose values may be mail addresses."""
ADDRESS = re.compile(r"(?<![a-z0-9+.-])[a-z][a-z0-9+.-]{0,30}://\S+", re.IGNORECASE)
"""An address anywhere in a text."""
LONGEST = 500
"""Longest text in the trail, characters; longer ones are cut."""
DEEPEST = 20
"""Deepest nesting of objects and lists in the trail; deeper ones are cut."""


@dataclass(frozen=True, slots=True)
class AuditContext:
    """The person or program behind a change, and the request or command."""

    by: str
    address: str
    action: str
    target: str
    details: Mapping[str, Any]


class AuditedSession(Session):
    """A session through which a person writes."""


def audited(
    sessions: sessionmaker[Session],
    audit_context: Callable[[], AuditContext | None],
    clock: Callable[[], datetime] = lambda: datetime.now(UTC),
) -> sessionmaker[Session]:
    """The sessions, with their changes recorded in the audit trail.

    Args:
        sessions: sessions that may write.
        audit_context: called at each commit of a change; None where the trail has the entry already.
        clock: aware time.
    """
    info = {CONTEXT: audit_context, CLOCK: clock}
    return sessionmaker(sessions.kw["bind"], class_=AuditedSession, expire_on_commit=False, info=info)


def note(session: Session, context: AuditContext, now: datetime) -> None:
    """Add an entry about something that changes no data, such as an attempt to log in."""
    session.add(_entry(context, now))


def without_secrets(value: Any, depth: int = 0) -> Any:  # noqa: ANN401  whatever JSON may hold
    """The value with secrets hidden, addresses reduced to their server, and long texts and deep nesting cut."""
    if depth > DEEPEST:
        return "(nested too deeply)"
    match value:
        case Mapping():
            return {key: _member(key, member, depth + 1) for key, member in value.items()}
        case list() | tuple():
            return [without_secrets(member, depth + 1) for member in value]
        case str():
            return ADDRESS.sub(lambda match: _server(match.group()), value)[:LONGEST]
    return value


def _member(key: str, value: Any, depth: int) -> Any:  # noqa: ANN401  whatever JSON may hold
    """A value of an object; of a mail address only the first letter and the domain."""
    if SECRET.search(key):
        return "(hidden)"
    if ADDRESS_KEY.search(key) and isinstance(value, str) and "://" not in value and "@" in value:
        return f"{value[:1]}...@{value.rpartition('@')[2]}"[:LONGEST]
    return without_secrets(value, depth)


def _server(address: str) -> str:
    """The scheme and the server of an address.

    Its path, query and user may be secrets, and so may the host of one that is not of the web, such as slack://TOKEN.
    """
    scheme = address.partition("://")[0]
    try:
        host = urlsplit(address).hostname if scheme.lower() in ("http", "https") else None
    except ValueError:  # brackets that do not match
        host = None
    return f"{scheme}://{host}/..." if host else f"{scheme}://..."


def _entry(context: AuditContext, now: datetime) -> AuditEntry:
    return AuditEntry(
        at=now,
        by=context.by,
        address=context.address,
        action=context.action,
        target=context.target,
        details=without_secrets(context.details),
    )


def _note_flush(session: Session, *_: object) -> None:
    session.info[CHANGED] = True


def _note_statement(state: ORMExecuteState) -> None:
    if state.is_insert or state.is_update or state.is_delete:
        state.session.info[CHANGED] = True


def _write(session: Session) -> None:
    """Add the entry if the session has changed, or is about to change, anything."""
    waiting = session.new or session.deleted or any(session.is_modified(one) for one in session.dirty)
    if (session.info.pop(CHANGED, False) or waiting) and (context := session.info[CONTEXT]()) is not None:
        session.add(_entry(context, session.info[CLOCK]()))


event.listen(AuditedSession, "after_flush", _note_flush)
event.listen(AuditedSession, "do_orm_execute", _note_statement)
event.listen(AuditedSession, "before_commit", _write)


def entries(
    session: Session,
    by: str | None,
    after: datetime | None,
    before: datetime | None,
    cursor: int | None,
    limit: int,
) -> Sequence[AuditEntry]:
    """Changes by people, the latest first; `cursor` is the number of the last entry of the previous page."""
    query = select(AuditEntry)
    if by is not None:
        query = query.where(AuditEntry.by == by)
    if after is not None:
        query = query.where(AuditEntry.at >= after)
    if before is not None:
        query = query.where(AuditEntry.at < before)
    return session.scalars(latest(query, AuditEntry.id, cursor, limit)).all()
