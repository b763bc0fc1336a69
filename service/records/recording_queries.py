"""What is asked about files as they came: which could not be used, and why."""

from collections.abc import Mapping, Sequence
from datetime import datetime

from sqlalchemy import func, select
from sqlalchemy.orm import Session, joinedload

from service.records.tables import Recording

STATES: Mapping[str, str] = {"refused": "rejected", "stored": "waiting", "read": "read"}
"""The state of a recording as people read it, by that of its row."""
REJECTED = "refused"


def recordings(
    session: Session, building_id: int | None, state: str | None, before: int | None, limit: int
) -> Sequence[Recording]:
    """Files as they came, the latest first.

    Args:
        session: to read with.
        building_id: of one building; None: of all.
        state: one of the values of STATES; None: any.
        before: the number at which the page before ended.
        limit: rows.
    """
    question = select(Recording).options(joinedload(Recording.content), joinedload(Recording.building))
    if building_id is not None:
        question = question.where(Recording.building_id == building_id)
    if state is not None:
        question = question.where(Recording.state == next(row for row, said in STATES.items() if said == state))
    if before is not None:
        question = question.where(Recording.id < before)
    return session.scalars(question.order_by(Recording.id.desc()).limit(limit)).all()


def rejected(session: Session, building_id: int, since: datetime) -> Sequence[Recording]:
    """The building's files that came since then and that nothing could be used of, the earliest first."""
    of_building = (Recording.building_id == building_id, Recording.state == REJECTED, Recording.received_at > since)
    return session.scalars(select(Recording).where(*of_building).order_by(Recording.received_at, Recording.id)).all()


def rejected_counts(session: Session) -> Mapping[int, int]:
    """Number of rejected files, by building; a building without any is not in it."""
    question = select(Recording.building_id, func.count()).where(Recording.state == REJECTED)
    return {line[0]: line[1] for line in session.execute(question.group_by(Recording.building_id))}
