"""Tables of jobs and leases."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base
from service.models.tables import ModelVersion
from service.records.tables import Event


class Job(Base):
    """A job for an event, a model or a building; claimed under a lease, with the number of claims as its fencing
    token."""

    __tablename__ = "job"
    __table_args__ = (Index(None, "state", "id"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str]
    """One of service.kinds."""
    event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"), index=True)
    model_id: Mapped[int | None] = mapped_column(ForeignKey("model_version.id"), index=True)
    building_id: Mapped[int | None] = mapped_column(ForeignKey("building.id"), index=True)
    asked_by: Mapped[str | None]
    """Name of the key that requested it; None for jobs of the service itself."""
    arguments: Mapped[dict[str, Any]]
    state: Mapped[str]
    """`waiting`, `running`, `done`, `failed` or `cancelled`."""
    claims: Mapped[int] = mapped_column(default=0)
    failures: Mapped[int] = mapped_column(default=0)
    """Failed attempts; a stopped worker does not count."""
    claimed_until: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Text)
    refusal: Mapped[str | None] = mapped_column(Text)
    """Reason why the job cannot be done by any number of attempts."""
    progress: Mapped[dict[str, Any] | None]
    """`done` of `stages`, `doing`, the current step, and the `share` of the job that is done; None before the first
    stage."""
    result: Mapped[dict[str, Any] | None]
    """Result of jobs without tables of their own."""
    created_at: Mapped[datetime]
    finished_at: Mapped[datetime | None] = mapped_column(index=True)
    event: Mapped[Event | None] = relationship()
    model: Mapped[ModelVersion | None] = relationship()
    building: Mapped[Building | None] = relationship()


class Lease(Base):
    """The right of one process at a time to do something, such as polling."""

    __tablename__ = "lease"
    name: Mapped[str] = mapped_column(primary_key=True)
    holder: Mapped[str]
    until: Mapped[datetime]
    trouble: Mapped[str | None] = mapped_column(Text)
    """Obstacle to the holder's work, and its remedy after a semicolon; None if there is none."""
