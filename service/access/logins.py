"""Browser sessions, stored on the server, and links that log an admin in once."""

import time
from collections import OrderedDict, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import delete, or_, select, update
from sqlalchemy.orm import Session

from service.access.roles import digest, new_secret
from service.access.tables import ApiKey, LoginLink, LoginSession

LINKED = "login link"
"""Name in the audit trail of a caller who followed the operator's login link."""
LINK_LASTS = timedelta(hours=1)
"""Validity of a login link. Not tuned."""
REMEMBERED = timedelta(days=30)
"""Time after its last use when a session is deleted."""


@dataclass(frozen=True, slots=True)
class NewSession:
    """A new session."""

    name: str
    """Name of the key, link or person."""
    cookie: str
    """Value for the browser's cookie; not stored."""


def begin(session: Session, key: str, now: datetime) -> NewSession | None:
    """A new session of a key; None if no valid key matches."""
    lasts = or_(ApiKey.expires_at.is_(None), ApiKey.expires_at > now)
    valid = (ApiKey.hash == digest(key), ApiKey.revoked_at.is_(None), lasts)
    row = session.scalars(select(ApiKey).where(*valid)).one_or_none()
    if row is None:
        return None
    row.used_at = now
    return NewSession(row.name, _cookie(session, LoginSession(key_id=row.id), now))


def new_link(session: Session, now: datetime) -> str:
    """Token of a link that logs an admin in once within LINK_LASTS; earlier links become invalid."""
    session.execute(delete(LoginLink))
    token = new_secret("ml")
    session.add(LoginLink(hash=digest(token), created_at=now))
    return token


def follow(session: Session, token: str, now: datetime) -> NewSession | None:
    """A new session by a login link; None if the link was used before, is too old or never existed."""
    unused = (LoginLink.hash == digest(token), LoginLink.used_at.is_(None), LoginLink.created_at > now - LINK_LASTS)
    used = session.execute(update(LoginLink).where(*unused).values(used_at=now).returning(LoginLink.id)).all()
    return NewSession(LINKED, _cookie(session, LoginSession(), now)) if used else None


def begin_signed_in(
    session: Session, person: str, issuer: str, groups: Sequence[str], state: str, now: datetime, end: datetime
) -> NewSession | None:
    """A new session of a person, which has an end whatever its use; None if the state was used before."""
    sign_in = digest(state)
    if session.scalar(select(LoginSession.id).where(LoginSession.sign_in == sign_in)) is not None:
        return None
    of_person = LoginSession(issuer=issuer, person=person, groups=list(groups), sign_in=sign_in, expires_at=end)
    return NewSession(person, _cookie(session, of_person, now))


def touch(session: Session, session_digest: str, now: datetime) -> None:
    """Note that the session was used."""
    session.execute(update(LoginSession).where(LoginSession.hash == session_digest).values(used_at=now))


def end(session: Session, session_digest: str, now: datetime) -> str | None:
    """End the session; the name of its key or person, or None if it was not valid."""
    query = select(LoginSession).where(LoginSession.hash == session_digest, LoginSession.ended_at.is_(None))
    row = session.scalars(query).one_or_none()
    if row is None:
        return None
    row.ended_at = now
    return row.person or (LINKED if row.key is None else row.key.name)


def end_all(session: Session, key_id: int | None, now: datetime) -> int:
    """End all sessions of a key, or those of all keys and links; the number of valid ones that were ended."""
    which = [] if key_id is None else [LoginSession.key_id == key_id]
    query = update(LoginSession).where(LoginSession.ended_at.is_(None), *which).values(ended_at=now)
    return len(session.execute(query.returning(LoginSession.id)).all())


def end_person(session: Session, name: str, now: datetime) -> int:
    """End all sessions of a person who signed in; the number of valid ones that were ended."""
    of_person = (LoginSession.ended_at.is_(None), LoginSession.person == name)
    query = update(LoginSession).where(*of_person).values(ended_at=now)
    return len(session.execute(query.returning(LoginSession.id)).all())


def _cookie(session: Session, begun: LoginSession, now: datetime) -> str:
    """Store a session with a new random cookie, and return the cookie."""
    session.execute(delete(LoginSession).where(LoginSession.used_at < now - REMEMBERED))
    cookie = new_secret("ms")
    begun.hash, begun.created_at, begun.used_at = digest(cookie), now, now
    session.add(begun)
    return cookie


ATTEMPTS = 10
"""Refused attempts that an address may make in a WINDOW; a common choice against guessing."""
WINDOW = 60.0
"""s in which refused attempts are counted."""
ADDRESSES = 10_000
"""Number of addresses to remember; beyond it the oldest is dropped."""


class Attempts:
    """Refused attempts by address in the last WINDOW."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._refused: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, address: str) -> float:
        """s until the address may try again, 0 if it may now."""
        times = self._refused.get(address)
        if times is None:
            return 0.0
        while times and times[0] < self._clock() - WINDOW:
            times.popleft()
        return times[0] + WINDOW - self._clock() if len(times) >= ATTEMPTS else 0.0

    def refuse(self, address: str) -> None:
        """Count another refused attempt."""
        self._refused.setdefault(address, deque(maxlen=ATTEMPTS)).append(self._clock())
        self._refused.move_to_end(address)
        while len(self._refused) > ADDRESSES:
            self._refused.popitem(last=False)
