"""What is asked about what people did."""

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from service.access.tables import AuditEntry


def entries(
    session: Session,
    by: str | None,
    after: datetime | None,
    before: datetime | None,
    cursor: int | None,
    limit: int,
) -> Sequence[AuditEntry]:
    """What people changed, the latest first; `cursor` is the number at which the page before ended."""
    question = select(AuditEntry)
    if by is not None:
        question = question.where(AuditEntry.by == by)
    if after is not None:
        question = question.where(AuditEntry.at >= after)
    if before is not None:
        question = question.where(AuditEntry.at < before)
    if cursor is not None:
        question = question.where(AuditEntry.id < cursor)
    return session.scalars(question.order_by(AuditEntry.id.desc()).limit(limit)).all()
