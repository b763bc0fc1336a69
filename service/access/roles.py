"""Roles, and the callers that have them."""

import hashlib
import secrets
from dataclasses import dataclass
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
    buildings: frozenset[str] | None = None
    """Codes of the buildings that exist for the caller; None for all."""
    expires_at: datetime | None = None
    """End of the caller's key or link."""


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
