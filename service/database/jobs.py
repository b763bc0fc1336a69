"""Tables of the work that waits, and of rights that one process holds at a time."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.database.base import Base
from service.database.events import Event


class Job(Base):
    """Work to be done on an event; claimed under a lease, its claims count is the fencing token."""

    __tablename__ = "job"
    __table_args__ = (Index(None, "state", "id"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True)
    arguments: Mapped[dict[str, Any]]
    state: Mapped[str]
    """`waiting`, `running`, `done` or `failed`."""
    claims: Mapped[int] = mapped_column(default=0)
    failures: Mapped[int] = mapped_column(default=0)
    """Attempts that went wrong; a worker that was stopped is none."""
    claimed_until: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[datetime]
    finished_at: Mapped[datetime | None]
    event: Mapped[Event] = relationship()


class Lease(Base):
    """A right that one process holds at a time, such as polling."""

    __tablename__ = "lease"
    name: Mapped[str] = mapped_column(primary_key=True)
    holder: Mapped[str]
    until: Mapped[datetime]
