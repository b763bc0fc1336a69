"""Roles, and the callers that have them."""

import hashlib
import secrets
from dataclasses import dataclass
from enum import IntEnum

VISIBLE = 11
"""Characters of a key that lists show: the prefix and 8 of its 43."""


class Role(IntEnum):
    """What a key may do; each includes those before it."""

    viewer = 1
    """Read."""
    engineer = 2
    """Ask for analyses as well."""
    admin = 3
    """Everything."""


@dataclass(frozen=True, slots=True)
class Caller:
    """Who is asking."""

    name: str
    role: Role


def new_secret(prefix: str) -> str:
    """A secret with 256 random bits; so many that a plain SHA-256 of it cannot be searched."""
    return f"{prefix}_{secrets.token_urlsafe(32)}"


def digest(secret: str) -> str:
    """What is stored of a secret: its visible beginning and its SHA-256."""
    return f"{secret[:VISIBLE]}:{hashlib.sha256(secret.encode()).hexdigest()}"
