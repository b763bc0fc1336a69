"""Tables of alerts, their changes, inspections and silences."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, Text, column
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base
from service.records.tables import Event

OPEN = column("closed_at").is_(None)


class Alert(Base):
    """An alert of a building, from its first evidence to its end; at most one open per cause."""

    __tablename__ = "alert"
    __table_args__ = (
        Index("uq_alert_open", "building_id", "cause", unique=True, sqlite_where=OPEN, postgresql_where=OPEN),
    )
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), index=True)
    cause: Mapped[str]
    """Its subject, such as `stiffness`, `frequency/x/1` or `source`."""
    kind: Mapped[str]
    """One of service.alerts.candidates.KINDS."""
    state: Mapped[str]
    """One of service.alerts.lifecycle."""
    began_at: Mapped[datetime]
    """Beginning of the condition."""
    changed_after: Mapped[datetime | None]
    """Start of the last event that did not show it; None for a periodic check."""
    changed_by: Mapped[datetime | None]
    """Start of the first event that certainly did: it began between the two."""
    onset_event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"))
    """First event that shows it; None for a periodic check."""
    raised_event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"), index=True)
    """Event whose result made it active; its message reports the alert."""
    event_ids: Mapped[list[int]]
    """Events that triggered it."""
    channels: Mapped[list[str]]
    evidence: Mapped[dict[str, Any]]
    summary: Mapped[str] = mapped_column(Text)
    sentences: Mapped[list[str]]
    held_by: Mapped[str | None]
    """Cause of the alert that may explain it, which keeps it on hold while open."""
    opened_at: Mapped[datetime]
    updated_at: Mapped[datetime]
    """Time when its evidence was last confirmed."""
    activated_at: Mapped[datetime | None]
    acknowledged_at: Mapped[datetime | None]
    acknowledged_by: Mapped[str | None]
    acknowledgement: Mapped[str | None] = mapped_column(Text)
    """Note of the acknowledgement."""
    assigned_to: Mapped[str | None]
    """Person who looks after it; None where no one was named."""
    closed_at: Mapped[datetime | None]
    """Time when it was resolved or withdrawn."""
    building: Mapped[Building] = relationship()
    raised_event: Mapped[Event | None] = relationship(foreign_keys=raised_event_id)
    changes: Mapped[list["AlertChange"]] = relationship(back_populates="alert", order_by="AlertChange.id")
    inspections: Mapped[list["Inspection"]] = relationship(back_populates="alert", order_by="Inspection.id")
    comments: Mapped[list["AlertComment"]] = relationship(back_populates="alert", order_by="AlertComment.id")


class AlertChange(Base):
    """A change of an alert's state, with the evidence at that time."""

    __tablename__ = "alert_change"
    id: Mapped[int] = mapped_column(primary_key=True)
    alert_id: Mapped[int] = mapped_column(ForeignKey("alert.id"), index=True)
    at: Mapped[datetime]
    state: Mapped[str]
    """After the change."""
    by: Mapped[str | None]
    """Name of the person; None for the service itself."""
    note: Mapped[str] = mapped_column(Text)
    """Reason."""
    summary: Mapped[str] = mapped_column(Text)
    evidence: Mapped[dict[str, Any]]
    alert: Mapped[Alert] = relationship(back_populates="changes")


class AlertComment(Base):
    """A comment on an alert, or its assignment to a person; never changed afterwards."""

    __tablename__ = "alert_comment"
    id: Mapped[int] = mapped_column(primary_key=True)
    alert_id: Mapped[int] = mapped_column(ForeignKey("alert.id"), index=True)
    at: Mapped[datetime]
    by: Mapped[str]
    text: Mapped[str] = mapped_column(Text)
    assigned_to: Mapped[str | None]
    """Person to whom it was assigned with the comment; None of a comment alone."""
    alert: Mapped[Alert] = relationship(back_populates="comments")


class Inspection(Base):
    """An inspection of the building, or a review of the data, that ended an alert."""

    __tablename__ = "inspection"
    id: Mapped[int] = mapped_column(primary_key=True)
    alert_id: Mapped[int] = mapped_column(ForeignKey("alert.id"), index=True)
    at: Mapped[datetime]
    by: Mapped[str]
    outcome: Mapped[str]
    """One of service.alerts.lifecycle.OUTCOMES."""
    note: Mapped[str] = mapped_column(Text)
    reference_from: Mapped[datetime | None]
    """Start of the new reference period; None: the reference period stays."""
    evidence: Mapped[dict[str, Any]]
    """Evidence at that time: if it gets worse later, a new alert opens."""
    alert: Mapped[Alert] = relationship(back_populates="inspections")


class BuildingInspection(Base):
    """An inspection of a building that a person signed, whether an alert is open or not; never changed afterwards."""

    __tablename__ = "building_inspection"
    __table_args__ = (Index(None, "building_id", "inspected_at"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    inspected_at: Mapped[datetime]
    """Time when it was made; it covers earlier earthquakes only."""
    recorded_at: Mapped[datetime]
    by: Mapped[str]
    """Name of the key or account that signed it, with the person's name where that is another."""
    result: Mapped[str]
    """One of service.verdict.assessment.Result."""
    comment: Mapped[str] = mapped_column(Text)
    level: Mapped[str]
    """Automatic level when it was recorded."""
    headline: Mapped[str] = mapped_column(Text)
    """Verdict when it was recorded, in one line."""
    building: Mapped[Building] = relationship()


class Silence(Base):
    """A time without messages about some alerts of a building; they are stored and shown all the same."""

    __tablename__ = "silence"
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), index=True)
    pattern: Mapped[str]
    """Pattern of causes; the wildcards are an asterisk and a question mark."""
    starts_at: Mapped[datetime]
    ends_at: Mapped[datetime]
    reason: Mapped[str] = mapped_column(Text)
    by: Mapped[str]
    created_at: Mapped[datetime]
    ended_by: Mapped[str | None]
    """Name of the person who ended it early."""
    building: Mapped[Building] = relationship()


class BuildingCheck(Base):
    """The last periodic check of a building that found nothing to write."""

    __tablename__ = "building_check"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    checked_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    """Time of the next check whatever the facts are."""
    facts: Mapped[str]
    """SHA-256 of what it was about."""
    has_source: Mapped[bool]
    is_continuous: Mapped[bool]
    described_at: Mapped[datetime]
    """Time when the building's description took effect."""
