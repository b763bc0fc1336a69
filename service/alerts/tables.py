"""Tables of the alerts, of every change of theirs, and of what people did about them."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, Text, column
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base
from service.records.tables import Event

OPEN = column("closed_at").is_(None)


class Alert(Base):
    """Something that people should know of a building, from its first sign to its end; at most one open per cause."""

    __tablename__ = "alert"
    __table_args__ = (
        Index("uq_alert_open", "building_id", "cause", unique=True, sqlite_where=OPEN, postgresql_where=OPEN),
    )
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), index=True)
    cause: Mapped[str]
    """What it is about, such as `stiffness`, `frequency/x/1` or `source`."""
    kind: Mapped[str]
    """One of service.alerts.candidates.KINDS."""
    state: Mapped[str]
    """One of service.alerts.states."""
    began_at: Mapped[datetime]
    """Since when what it tells of has been so."""
    changed_after: Mapped[datetime | None]
    """Start of the last event that did not show it, and"""
    changed_by: Mapped[datetime | None]
    """of the first that surely did: it began between them. None of what goes by the clock."""
    onset_event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"))
    """First event that shows it; None of what goes by the clock."""
    raised_event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"), index=True)
    """Event whose result made it active, and whose message reports it."""
    event_ids: Mapped[list[int]]
    """Events that triggered it."""
    channels: Mapped[list[str]]
    evidence: Mapped[dict[str, Any]]
    summary: Mapped[str] = mapped_column(Text)
    sentences: Mapped[list[str]]
    held_by: Mapped[str | None]
    """Cause of the alert that may explain it: it is on hold while that one is open."""
    opened_at: Mapped[datetime]
    updated_at: Mapped[datetime]
    """When its evidence was found last."""
    activated_at: Mapped[datetime | None]
    acknowledged_at: Mapped[datetime | None]
    acknowledged_by: Mapped[str | None]
    acknowledgement: Mapped[str | None] = mapped_column(Text)
    """Note of who acknowledged it."""
    closed_at: Mapped[datetime | None]
    """When it was resolved or withdrawn."""
    building: Mapped[Building] = relationship()
    raised_event: Mapped[Event | None] = relationship(foreign_keys=raised_event_id)
    changes: Mapped[list["AlertChange"]] = relationship(back_populates="alert", order_by="AlertChange.id")
    inspections: Mapped[list["Inspection"]] = relationship(back_populates="alert", order_by="Inspection.id")


class AlertChange(Base):
    """A change of an alert's state, with what was known then."""

    __tablename__ = "alert_change"
    id: Mapped[int] = mapped_column(primary_key=True)
    alert_id: Mapped[int] = mapped_column(ForeignKey("alert.id"), index=True)
    at: Mapped[datetime]
    state: Mapped[str]
    """After the change."""
    by: Mapped[str | None]
    """Who did it; None of the service itself."""
    note: Mapped[str] = mapped_column(Text)
    """Why."""
    summary: Mapped[str] = mapped_column(Text)
    evidence: Mapped[dict[str, Any]]
    alert: Mapped[Alert] = relationship(back_populates="changes")


class Inspection(Base):
    """What somebody found at the building, which ends an alert."""

    __tablename__ = "inspection"
    id: Mapped[int] = mapped_column(primary_key=True)
    alert_id: Mapped[int] = mapped_column(ForeignKey("alert.id"), index=True)
    at: Mapped[datetime]
    by: Mapped[str]
    outcome: Mapped[str]
    """One of service.alerts.acts.OUTCOMES."""
    note: Mapped[str] = mapped_column(Text)
    reference_from: Mapped[datetime | None]
    """From when on the building counts as healthy again; None: as before."""
    evidence: Mapped[dict[str, Any]]
    """What was known of the alert then: what is worse later on is a new one."""
    alert: Mapped[Alert] = relationship(back_populates="inspections")


class Silence(Base):
    """A time during which nobody is told of some alerts of a building; they are kept and shown all the same."""

    __tablename__ = "silence"
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), index=True)
    pattern: Mapped[str]
    """Of causes, with * and ?."""
    starts_at: Mapped[datetime]
    ends_at: Mapped[datetime]
    reason: Mapped[str] = mapped_column(Text)
    by: Mapped[str]
    created_at: Mapped[datetime]
    ended_by: Mapped[str | None]
    """Who ended it before its time."""
    building: Mapped[Building] = relationship()
