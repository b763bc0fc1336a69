"""Browsers that log in: sessions, which live on the server, and links that log an admin in once."""

import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from service.access.roles import digest, new_secret
from service.access.tables import ApiKey, LoginLink, LoginSession

LINKED = "login link"
"""Name of whoever followed the link that was shown to the operator of the service."""
LINK_LASTS = timedelta(hours=1)
REMEMBERED = timedelta(days=30)
"""After its last use a session is deleted."""


@dataclass(frozen=True, slots=True)
class Begun:
    """A session that has begun."""

    name: str
    """Of who it is."""
    cookie: str
    """For the browser; it is not stored."""


def begin(session: Session, key: str, now: datetime) -> Begun | None:
    """A new session of a key; None where no key in force is like that."""
    found = session.scalars(select(ApiKey).where(ApiKey.hash == digest(key), ApiKey.revoked_at.is_(None))).one_or_none()
    return None if found is None else Begun(found.name, _cookie(session, found.id, now))


def new_link(session: Session, now: datetime) -> str:
    """The token of a link that logs an admin in once, within LINK_LASTS; earlier links no longer do."""
    session.execute(delete(LoginLink))
    token = new_secret("ml")
    session.add(LoginLink(hash=digest(token), created_at=now))
    return token


def follow(session: Session, token: str, now: datetime) -> Begun | None:
    """A new session of whoever follows a link; None where it was followed before, is too old, or never was."""
    unused = (LoginLink.hash == digest(token), LoginLink.used_at.is_(None), LoginLink.created_at > now - LINK_LASTS)
    taken = session.execute(update(LoginLink).where(*unused).values(used_at=now).returning(LoginLink.id)).all()
    return Begun(LINKED, _cookie(session, None, now)) if taken else None


def touch(session: Session, session_digest: str, now: datetime) -> None:
    """The session was used."""
    session.execute(update(LoginSession).where(LoginSession.hash == session_digest).values(used_at=now))


def end(session: Session, session_digest: str, now: datetime) -> str | None:
    """The session is over; whose it was, None where it was none that could be used."""
    question = select(LoginSession).where(LoginSession.hash == session_digest, LoginSession.ended_at.is_(None))
    found = session.scalars(question).one_or_none()
    if found is None:
        return None
    found.ended_at = now
    return LINKED if found.key is None else found.key.name


def end_all(session: Session, key_id: int | None, now: datetime) -> int:
    """All sessions of a key are over, or those of all keys and links; the number of those that were not yet."""
    which = [] if key_id is None else [LoginSession.key_id == key_id]
    question = update(LoginSession).where(LoginSession.ended_at.is_(None), *which).values(ended_at=now)
    return len(session.execute(question.returning(LoginSession.id)).all())


def _cookie(session: Session, key_id: int | None, now: datetime) -> str:
    session.execute(delete(LoginSession).where(LoginSession.used_at < now - REMEMBERED))
    cookie = new_secret("ms")
    session.add(LoginSession(hash=digest(cookie), key_id=key_id, created_at=now, used_at=now))
    return cookie


ATTEMPTS = 10
"""Refused attempts that an address has in a WINDOW."""
WINDOW = 60.0
"""s."""
ADDRESSES = 10_000
"""That are remembered; beyond, the one that tried longest ago is forgotten."""


class Attempts:
    """Refused attempts of the last WINDOW, by address."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._refused: OrderedDict[str, deque[float]] = OrderedDict()

    def wait(self, address: str) -> float:
        """s after which the address may try again, 0 if it may now."""
        times = self._refused.get(address)
        if times is None:
            return 0.0
        while times and times[0] < self._clock() - WINDOW:
            times.popleft()
        return times[0] + WINDOW - self._clock() if len(times) >= ATTEMPTS else 0.0

    def refuse(self, address: str) -> None:
        """One more attempt was refused."""
        self._refused.setdefault(address, deque(maxlen=ATTEMPTS)).append(self._clock())
        self._refused.move_to_end(address)
        while len(self._refused) > ADDRESSES:
            self._refused.popitem(last=False)
