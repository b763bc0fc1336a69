"""Callers that are admitted now: valid keys and browser sessions, cached from the database."""

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from anyio import CapacityLimiter, to_thread
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys as access_keys, logins
from service.access.roles import Caller, Role
from service.access.tables import ApiKey
from service.db.sessions import reading

log = logging.getLogger(__name__)

FRESH = 1.0
"""s for which a process caches the callers, so that a revoked key works that much longer at most."""
TOUCHED = timedelta(minutes=1)
"""Resolution of the time of the last use of a key or a session."""
LINKED = Caller(logins.LINKED, Role.admin)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All callers by the digest of their key or cookie."""

    keys: Mapping[str, Caller] = field(default_factory=dict)
    logins: Mapping[str, Caller] = field(default_factory=dict)
    used: Mapping[str, datetime | None] = field(default_factory=dict)
    """Last use of each key and login in the database; None before the first."""
    has_had_keys: bool = True


class Callers:
    """All callers, read from the database at most once per FRESH seconds, by one thread at a time."""

    def __init__(
        self,
        sessions: sessionmaker[Session],
        idle: timedelta,
        lifetime: timedelta,
        clock: Callable[[], float] = time.monotonic,
        now: Callable[[], datetime] = lambda: datetime.now(UTC),
    ) -> None:
        self._sessions, self._reading = sessions, reading(sessions)
        self._idle, self._lifetime = idle, lifetime
        self._clock, self._now = clock, now
        self._known, self._read_at = Snapshot(), -float("inf")
        self._pending: asyncio.Task[Snapshot] | None = None
        self._touches: dict[str, asyncio.Task[None]] = {}
        self._threads = CapacityLimiter(2)  # its own pool: requests that wait for a shared thread must not delay this

    async def known(self) -> Snapshot:
        """All callers."""
        while self._clock() - self._read_at > FRESH:
            if self._pending is None or self._pending.done():
                self._pending = asyncio.create_task(self._read())
            await asyncio.shield(self._pending)
        return self._known

    def forget(self) -> None:
        """Read the callers again for the next request, after a login or logout."""
        self._read_at, self._pending = -float("inf"), None

    def note_use(self, secret: str) -> None:
        """Store the time of the last use of a key or login in another thread, so that the request does not wait."""
        known, now = self._known, self._now()
        if secret not in known.used or secret in self._touches:
            return
        used = known.used[secret]
        if used is None or now - used >= min(TOUCHED, self._idle / 10):
            task = self._touches[secret] = asyncio.create_task(self._touch(secret, now))
            task.add_done_callback(lambda _: self._touches.pop(secret, None))

    def touches(self) -> tuple[asyncio.Task[None], ...]:
        """Uses that are being stored."""
        return tuple(self._touches.values())

    async def _read(self) -> Snapshot:
        mine = asyncio.current_task()
        snapshot = await to_thread.run_sync(self._snapshot, limiter=self._threads)
        if self._pending is mine:  # otherwise it was read before the latest login or logout
            self._known, self._read_at = snapshot, self._clock()
        return snapshot

    def _snapshot(self) -> Snapshot:
        now = self._now()
        with self._reading() as session:
            valid = access_keys.valid_keys(session, now)
            active = access_keys.valid_logins(session, now, now - self._idle, now - self._lifetime)
            return Snapshot(
                keys={key.hash: _key_caller(key) for key in valid},
                logins={one.hash: LINKED if one.key is None else _key_caller(one.key) for one in active},
                used={key.hash: key.used_at for key in valid} | {login.hash: login.used_at for login in active},
                has_had_keys=access_keys.has_had_keys(session),
            )

    async def _touch(self, secret: str, now: datetime) -> None:
        store = access_keys.touch if secret in self._known.keys else logins.touch

        def touch() -> None:
            with self._sessions.begin() as session:
                store(session, secret, now)

        try:
            await to_thread.run_sync(touch, limiter=self._threads)
        except SQLAlchemyError:
            log.warning("the last use of a key or login could not be stored; a login may end earlier than it should")


def _key_caller(key: ApiKey) -> Caller:
    buildings = None if key.buildings is None else frozenset(key.buildings)
    return Caller(key.name, Role[key.role], buildings, key.expires_at)
