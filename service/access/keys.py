"""API keys: creation, listing and revocation, and the keys and logins that are valid."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import or_, select
from sqlalchemy.orm import Session, joinedload

from service.access import logins
from service.access.roles import Role, digest, new_secret
from service.access.tables import ApiKey, LoginSession


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


def valid_keys(session: Session) -> Sequence[ApiKey]:
    """Keys that are not revoked."""
    return session.scalars(select(ApiKey).where(ApiKey.revoked_at.is_(None))).all()


def has_had_keys(session: Session) -> bool:
    """True if any key was ever created, revoked ones included."""
    return session.scalar(select(ApiKey.id).limit(1)) is not None


def valid_logins(session: Session, used_after: datetime, created_after: datetime) -> Sequence[LoginSession]:
    """Valid browser sessions with their keys: not ended, idle or expired, and with a valid key."""
    query = select(LoginSession).outerjoin(LoginSession.key).options(joinedload(LoginSession.key))
    living = (
        LoginSession.ended_at.is_(None),
        LoginSession.used_at > used_after,
        LoginSession.created_at > created_after,
        or_(LoginSession.key_id.is_(None), ApiKey.revoked_at.is_(None)),
    )
    return session.scalars(query.where(*living)).all()


def _find(session: Session, name: str) -> ApiKey | None:
    return session.scalars(select(ApiKey).where(ApiKey.name == name)).one_or_none()
