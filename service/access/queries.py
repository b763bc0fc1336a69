"""Queries of keys and logins."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import or_, select
from sqlalchemy.orm import Session, joinedload

from service.access.tables import ApiKey, LoginSession


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
