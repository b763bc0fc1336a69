"""API keys: creation, listing and revocation."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.access import logins
from service.access.roles import Role, digest, new_secret
from service.access.tables import ApiKey


class KeyNameError(Exception):
    """The name of a key is in use, or unknown."""


def create(session: Session, name: str, role: Role, now: datetime) -> str:
    """A new key; it is not stored and cannot be shown again.

    Raises:
        KeyNameError: the name is in use, or was that of a revoked key: names are never used again.
    """
    if _find(session, name) is not None:
        raise KeyNameError(f"There is a key {name!r} already; choose another name.")
    key = new_secret("mk")
    session.add(ApiKey(name=name, role=role.name, hash=digest(key), created_at=now))
    return key


def every(session: Session) -> Sequence[ApiKey]:
    """All keys, revoked ones too, by name."""
    return session.scalars(select(ApiKey).order_by(ApiKey.name)).all()


def revoke(session: Session, name: str, now: datetime) -> None:
    """Revoke a key and end its browser sessions; revoking it again changes nothing.

    Raises:
        KeyNameError: no key has that name.
    """
    key = _find(session, name)
    if key is None:
        raise KeyNameError(f"There is no key {name!r}; 'menshin key list' shows them.")
    key.revoked_at = key.revoked_at or now
    logins.end_all(session, key.id, now)


def log_out(session: Session, name: str | None, now: datetime) -> int:
    """End all browser sessions, or those of one key; the number of valid ones that were ended.

    Raises:
        KeyNameError: no key has that name.
    """
    if name is None:
        return logins.end_all(session, None, now)
    key = _find(session, name)
    if key is None:
        raise KeyNameError(f"There is no key {name!r}; 'menshin key list' shows them.")
    return logins.end_all(session, key.id, now)


def _find(session: Session, name: str) -> ApiKey | None:
    return session.scalars(select(ApiKey).where(ApiKey.name == name)).one_or_none()
