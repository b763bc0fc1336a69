"""Lifetime of a browser's login."""

import asyncio
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy.orm import Session, sessionmaker

from service.access import keys, logins
from service.access.callers import Callers
from service.access.roles import Caller, Role, digest

BEGUN = datetime(2024, 1, 1, tzinfo=UTC)
IDLE, LIFETIME = timedelta(hours=12), timedelta(days=7)
VIEWER = Caller("people", Role.viewer)


class Watch:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = BEGUN

    def monotonic(self) -> float:
        return (self.now - BEGUN).total_seconds()


@pytest.fixture
def login(sessions: sessionmaker[Session]) -> str:
    """Digest of a session that began at BEGUN."""
    with sessions.begin() as session:
        started = logins.begin(session, keys.create(session, "people", Role.viewer, BEGUN), BEGUN)
    assert started is not None
    return digest(started.cookie)


async def requested(callers: Callers, login: str) -> Caller | None:
    """The caller, once the use has been stored."""
    found = (await callers.known()).logins.get(login)
    callers.note_use(login)
    await asyncio.gather(*callers.touches())
    return found


@pytest.mark.parametrize(("hours", "caller"), [(11.9, VIEWER), (12.1, None)])
def test_an_idle_session_ends(sessions: sessionmaker[Session], login: str, hours: float, caller: Caller | None) -> None:
    async def later() -> Caller | None:
        watch = Watch()
        callers = Callers(sessions, IDLE, LIFETIME, watch.monotonic, lambda: watch.now)
        watch.now += timedelta(hours=hours)
        return await requested(callers, login)

    assert asyncio.run(later()) == caller


def test_a_session_in_use_ends_after_its_lifetime(sessions: sessionmaker[Session], login: str) -> None:
    async def used() -> list[float]:
        watch = Watch()
        callers = Callers(sessions, IDLE, LIFETIME, watch.monotonic, lambda: watch.now)
        ended = []
        while watch.now < BEGUN + timedelta(days=8):
            if await requested(callers, login) is None:
                ended.append((watch.now - BEGUN) / timedelta(days=1))
            watch.now += timedelta(hours=6)
        return ended

    assert asyncio.run(used()) == [7.0, 7.25, 7.5, 7.75]


def test_all_sessions_of_a_key_are_ended_at_once(sessions: sessionmaker[Session], login: str) -> None:
    with sessions.begin() as session:
        assert keys.log_out(session, "people", BEGUN) == 1
    with sessions.begin() as session:
        assert keys.log_out(session, None, BEGUN) == 0, "none is left"
    callers = Callers(sessions, IDLE, LIFETIME, now=lambda: BEGUN)
    assert asyncio.run(callers.known()).logins == {}
    with pytest.raises(keys.KeyNameError, match="menshin key list"), sessions.begin() as session:
        keys.log_out(session, "nobody", BEGUN)
