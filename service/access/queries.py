"""Questions about who may see anything."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import or_, select
from sqlalchemy.orm import Session, joinedload

from service.access.tables import ApiKey, LoginSession


def keys_in_force(session: Session) -> Sequence[ApiKey]:
    """Keys that were not revoked."""
    return session.scalars(select(ApiKey).where(ApiKey.revoked_at.is_(None))).all()


def has_had_keys(session: Session) -> bool:
    """Whether any key was ever made, revoked ones included."""
    return session.scalar(select(ApiKey.id).limit(1)) is not None


def logins_in_force(session: Session, used_after: datetime, begun_after: datetime) -> Sequence[LoginSession]:
    """Browsers that are logged in, with their keys: neither ended nor idle nor too old, and their key not revoked."""
    question = select(LoginSession).outerjoin(LoginSession.key).options(joinedload(LoginSession.key))
    living = (
        LoginSession.ended_at.is_(None),
        LoginSession.used_at > used_after,
        LoginSession.created_at > begun_after,
        or_(LoginSession.key_id.is_(None), ApiKey.revoked_at.is_(None)),
    )
    return session.scalars(question.where(*living)).all()
