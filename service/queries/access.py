"""What is asked about who may see anything."""

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.database import ApiKey


def keys_in_force(session: Session) -> Sequence[ApiKey]:
    """Keys that were not revoked."""
    return session.scalars(select(ApiKey).where(ApiKey.revoked_at.is_(None))).all()
