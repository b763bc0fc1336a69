"""Callers that are admitted now: valid keys and browser sessions, cached from the database."""

import asyncio
import logging
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from anyio import CapacityLimiter, to_thread
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys as access_keys, links, logins
from service.access.roles import Caller, Grant, Role, granted
from service.access.tables import ApiKey, BuildingLink, LoginSession
from service.db.sessions import reading
from service.settings.groups import Oidc

log = logging.getLogger(__name__)

FRESH = 1.0
"""s for which a process caches the callers, so that a revoked key works that much longer at most."""
TOUCHED = timedelta(minutes=1)
"""Resolution of the time of the last use of a key or a session."""
SETTLED = 5.0
"""s to wait for the database when the application ends."""
NO_PROVIDER = Oidc()
LINKED = Caller(logins.LINKED, Role.admin)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """All callers by the digest of their key, their session's cookie or their link's token."""

    keys: Mapping[str, Caller] = field(default_factory=dict)
    logins: Mapping[str, Caller] = field(default_factory=dict)
    links: Mapping[str, Caller] = field(default_factory=dict)
    used: Mapping[str, datetime | None] = field(default_factory=dict)
    """Last use of each key, login and link in the database; None before the first."""
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
        oidc: Oidc = NO_PROVIDER,
    ) -> None:
        self._sessions, self._reading = sessions, reading(sessions)
        self._idle, self._lifetime = idle, lifetime
        self._oidc, self._clock, self._now = oidc, clock, now
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

    async def settle(self) -> None:
        """Wait until what is being read and stored is done, so that no connection is left open."""
        waiting = [*self.touches(), *([] if self._pending is None else [self._pending])]
        if waiting:
            await asyncio.wait(waiting, timeout=SETTLED)

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
            linked = links.valid(session, now)
            return Snapshot(
                keys={key.hash: _key_caller(key) for key in valid},
                logins={one.hash: caller for one in active if (caller := self._login_caller(one)) is not None},
                links={link.hash: links.caller(link) for link in linked},
                used=_used(valid) | _used(active) | _used(linked),
                has_had_keys=access_keys.has_had_keys(session),
            )

    def _login_caller(self, login: LoginSession) -> Caller | None:
        """The caller of a browser session; None for a person to whom the settings give no role any more."""
        if login.key is not None:
            return _key_caller(login.key)
        if login.issuer is None:
            return LINKED
        if login.issuer != self._oidc.issuer or login.person is None:
            return None
        return person_caller(self._oidc, login.person, login.groups or ())

    async def _touch(self, secret: str, now: datetime) -> None:
        known = self._known
        store = access_keys.touch if secret in known.keys else links.touch if secret in known.links else logins.touch

        def touch() -> None:
            with self._sessions.begin() as session:
                store(session, secret, now)

        try:
            await to_thread.run_sync(touch, limiter=self._threads)
        except SQLAlchemyError:
            log.warning("the last use of a key or login could not be stored; a login may end earlier than it should")


def _used(rows: Sequence[ApiKey] | Sequence[LoginSession] | Sequence[BuildingLink]) -> dict[str, datetime | None]:
    return {one.hash: one.used_at for one in rows}


def person_caller(oidc: Oidc, name: str, groups: Collection[str]) -> Caller | None:
    """A person with the roles of their groups; None if these have none."""
    of_groups = (one for one in oidc.grants if one.group in groups)
    grants = (Grant(Role[one.role], None if one.buildings is None else frozenset(one.buildings)) for one in of_groups)
    return granted(name, grants)


def _key_caller(key: ApiKey) -> Caller:
    buildings = None if key.buildings is None else frozenset(key.buildings)
    single = (Grant(Role[role], frozenset({code})) for code, role in (key.higher or {}).items())
    caller = granted(key.name, (Grant(Role[key.role], buildings), *single), key.expires_at)
    return caller or Caller(key.name, Role[key.role], frozenset(), key.expires_at)
