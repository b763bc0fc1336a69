"""Roles, and the callers that have them."""

import hashlib
import secrets
from collections.abc import Iterable
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from enum import IntEnum

VISIBLE = 11
"""Characters of a key that lists show: the prefix and 8 of its 43."""


class Role(IntEnum):
    """Permissions of a key; each role includes the lower ones."""

    viewer = 1
    """Read."""
    engineer = 2
    """Read, and request analyses and model work."""
    admin = 3
    """All permissions."""


@dataclass(frozen=True, slots=True)
class Caller:
    """The person or program that sends a request."""

    name: str
    role: Role
    """The role on every building of the caller: the lowest that it has on any."""
    buildings: frozenset[str] | None = None
    """Codes of the buildings that exist for the caller; None for all."""
    expires_at: datetime | None = None
    """End of the caller's key or link."""
    higher: frozenset[tuple[str, Role]] = frozenset()
    """Single buildings on which its role is higher, with that role."""

    def at_least(self, role: Role) -> "Caller | None":
        """The caller, limited to the buildings on which it has this role or a higher one; None if there are none."""
        if self.role >= role:
            return self
        enough = (Grant(own, frozenset({code})) for code, own in self.higher if own >= role)
        return granted(self.name, enough, self.expires_at)

    def on(self, building: str) -> "Caller":
        """The caller with its role on one building; one without any building if that one does not exist for it."""
        if self.buildings is not None and building not in self.buildings:
            return replace(self, role=Role.viewer, buildings=frozenset(), higher=frozenset())
        role = dict(self.higher).get(building, self.role)
        return replace(self, role=role, buildings=frozenset({building}), higher=frozenset())


@dataclass(frozen=True, slots=True)
class Grant:
    """A role on some buildings."""

    role: Role
    buildings: frozenset[str] | None = None
    """Codes of the buildings; None for all."""


def granted(name: str, grants: Iterable[Grant], expires_at: datetime | None = None) -> Caller | None:
    """The caller with the highest of its granted roles on each building; None if nothing was granted."""
    everywhere: Role | None = None
    single: dict[str, Role] = {}
    for one in grants:
        if one.buildings is None:
            everywhere = max(one.role, everywhere or one.role)
        for code in one.buildings or ():
            single[code] = max(one.role, single.get(code, one.role))
    if everywhere is None and not single:
        return None
    role = min(single.values()) if everywhere is None else everywhere
    higher = frozenset((code, own) for code, own in single.items() if own > role)
    return Caller(name, role, frozenset(single) if everywhere is None else None, expires_at, higher)


WARNED = timedelta(days=14)
"""Time before its end in which a key is warned of: whoever makes the next one may be on holiday. Not tuned."""


def ends_soon(end: datetime, now: datetime) -> bool:
    """True if people should be warned of this end of a key."""
    return end - now <= WARNED


def soon_in_words(end: datetime | None, now: datetime) -> str:
    """Time until an end that people are warned of, such as `in 3 days`; empty if it is later."""
    if end is None or not ends_soon(end, now):
        return ""
    days = (end - now) // timedelta(days=1)
    return f"in {days} day{'' if days == 1 else 's'}" if days else "in less than a day"


def new_secret(prefix: str) -> str:
    """A secret with 256 random bits, enough that its plain SHA-256 cannot be searched."""
    return f"{prefix}_{secrets.token_urlsafe(32)}"


def digest(secret: str) -> str:
    """Stored form of a secret: its visible beginning and its SHA-256."""
    return f"{secret[:VISIBLE]}:{hashlib.sha256(secret.encode()).hexdigest()}"
