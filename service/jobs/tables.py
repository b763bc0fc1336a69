"""Tables of the work that waits, and of rights that one process holds at a time."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.db.base import Base
from service.models.tables import ModelVersion
from service.records.tables import Event


class Job(Base):
    """Work on an event, a model or a building; claimed under a lease, its claims count is the fencing token."""

    __tablename__ = "job"
    __table_args__ = (Index(None, "state", "id"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    """One of service.kinds."""
    event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"), index=True)
    model_id: Mapped[int | None] = mapped_column(ForeignKey("model_version.id"), index=True)
    building_id: Mapped[int | None] = mapped_column(ForeignKey("building.id"), index=True)
    asked_by: Mapped[str | None]
    """Name of the key that asked for it; None where nobody had to."""
    arguments: Mapped[dict[str, Any]]
    state: Mapped[str]
    """`waiting`, `running`, `done`, `failed` or `cancelled`."""
    claims: Mapped[int] = mapped_column(default=0)
    failures: Mapped[int] = mapped_column(default=0)
    """Attempts that went wrong; a worker that was stopped is none."""
    claimed_until: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Text)
    refusal: Mapped[str | None] = mapped_column(Text)
    """Why what was asked cannot be done, however often one tries."""
    progress: Mapped[dict[str, Any] | None]
    """`done` of `stages`, and what it is `doing`; None before the first stage."""
    result: Mapped[dict[str, Any] | None]
    """What came of it, where no table of its own has that."""
    created_at: Mapped[datetime]
    finished_at: Mapped[datetime | None] = mapped_column(index=True)
    event: Mapped[Event | None] = relationship()
    model: Mapped[ModelVersion | None] = relationship()


class Lease(Base):
    """A right that one process holds at a time, such as polling."""

    __tablename__ = "lease"
    name: Mapped[str] = mapped_column(primary_key=True)
    holder: Mapped[str]
    until: Mapped[datetime]
