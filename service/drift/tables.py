"""Tables of reference periods, monitored series, their values and alarms."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base
from service.records.tables import Event


class ReferencePeriod(Base):
    """A period in which a building counted as healthy, set by an engineer; a later one overrides it, and it is kept."""

    __tablename__ = "reference_period"
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), index=True)
    quantity: Mapped[str | None]
    """One of core.drift.quantities; None: all of them."""
    subject: Mapped[str | None]
    """Direction, mode or channel; None: all of the quantity."""
    start: Mapped[datetime | None]
    """None: from the first event on."""
    end: Mapped[datetime | None]
    """None: until the curve is determined."""
    author: Mapped[str]
    """Name of the key that set it."""
    reason: Mapped[str] = mapped_column(Text)
    created_at: Mapped[datetime]
    building: Mapped[Building] = relationship()


class MonitoredSeries(Base):
    """One series of a building as last monitored; monitoring it again updates its rows where they differ."""

    __tablename__ = "watched_series"
    __table_args__ = (UniqueConstraint("building_id", "quantity", "subject"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    job_id: Mapped[int] = mapped_column(ForeignKey("job.id"), index=True)
    created_at: Mapped[datetime]
    version: Mapped[str]
    """Version of the code."""
    quantity: Mapped[str]
    subject: Mapped[str]
    """Direction, mode or channel."""
    reference_id: Mapped[int | None] = mapped_column(ForeignKey("reference_period.id"))
    """None: the first events."""
    wanted: Mapped[int]
    """Events that the reference still lacks."""
    baseline: Mapped[dict[str, Any] | None]
    """service.drift.baseline; None as long as nothing can be expected."""
    reference: Mapped[ReferencePeriod | None] = relationship()
    values: Mapped[list["DriftValue"]] = relationship(back_populates="series", order_by="DriftValue.id")
    alarms: Mapped[list["DriftAlarm"]] = relationship(back_populates="series", order_by="DriftAlarm.id")


class DriftState(Base):
    """State from which the next monitoring of a building goes on; derived from results, and made again if absent."""

    __tablename__ = "drift_state"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    created_at: Mapped[datetime]
    facts: Mapped[str]
    """SHA-256 of what it holds for beside the analyses: version, description and reference periods."""
    content: Mapped[bytes]
    """service.drift.state."""


class DriftValue(Base):
    """Deviation of an event from a series' baseline."""

    __tablename__ = "drift_value"
    __table_args__ = (UniqueConstraint("series_id", "event_id"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    series_id: Mapped[int] = mapped_column(ForeignKey("watched_series.id"))
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True)
    value: Mapped[float]
    """Relative, or in SI units where no logarithm is monitored."""
    std: Mapped[float]
    count: Mapped[int]
    """Observations it is from."""
    is_reference: Mapped[bool]
    is_beyond: Mapped[bool]
    is_excluded: Mapped[bool]
    causes: Mapped[list[str]]
    series: Mapped[MonitoredSeries] = relationship(back_populates="values")
    event: Mapped[Event] = relationship()


class DriftAlarm(Base):
    """An alarm of a rule in a series."""

    __tablename__ = "drift_alarm"
    id: Mapped[int] = mapped_column(primary_key=True)
    series_id: Mapped[int] = mapped_column(ForeignKey("watched_series.id"), index=True)
    rule: Mapped[str]
    is_sure: Mapped[bool]
    onset_event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True)
    after_event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"))
    """Last event that did not show it; None of rows from before it was kept."""
    by_event_id: Mapped[int | None] = mapped_column(ForeignKey("event.id"))
    """First event that showed it."""
    raised_event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True)
    event_ids: Mapped[list[int]]
    drift: Mapped[float]
    low: Mapped[float]
    high: Mapped[float]
    false_alarms: Mapped[float]
    causes: Mapped[list[str]]
    message: Mapped[str] = mapped_column(Text)
    series: Mapped[MonitoredSeries] = relationship(back_populates="alarms")
    onset: Mapped[Event] = relationship(foreign_keys=onset_event_id)
    after: Mapped[Event | None] = relationship(foreign_keys=after_event_id)
    by: Mapped[Event | None] = relationship(foreign_keys=by_event_id)
    raised: Mapped[Event] = relationship(foreign_keys=raised_event_id)
