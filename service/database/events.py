"""Tables of the earthquakes and what was recorded of them."""

from datetime import datetime
from typing import TYPE_CHECKING

from sqlalchemy import ForeignKey, Index, LargeBinary, Text, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.database.base import Base
from service.database.buildings import Building

if TYPE_CHECKING:
    from service.database.analyses import Analysis


class Event(Base):
    """One earthquake at one building."""

    __tablename__ = "event"
    __table_args__ = (Index(None, "building_id", "start"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    start: Mapped[datetime]
    end: Mapped[datetime]
    state: Mapped[str]
    """`gathering` (files may be missing), `queued`, `analysed`, `refused` or `failed`."""
    reason: Mapped[str | None] = mapped_column(Text)
    """Why it was refused, or what failed."""
    created_at: Mapped[datetime]
    updated_at: Mapped[datetime]
    building: Mapped[Building] = relationship()
    waveforms: Mapped[list["Waveform"]] = relationship(back_populates="event", order_by="Waveform.channel")
    analyses: Mapped[list["Analysis"]] = relationship(back_populates="event", order_by="Analysis.id")


class EventRecording(Base):
    """Which recordings an event was cut from."""

    __tablename__ = "event_recording"
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), primary_key=True)
    recording_id: Mapped[int] = mapped_column(ForeignKey("recording.id"), primary_key=True, index=True)


class Waveform(Base):
    """One channel of one event, as recorded: one compressed blob, not a row per sample."""

    __tablename__ = "waveform"
    __table_args__ = (UniqueConstraint("event_id", "channel", "start"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True)
    channel: Mapped[str]
    start: Mapped[datetime]
    rate: Mapped[float]
    count: Mapped[int]
    gain: Mapped[float]
    """SI units per stored number."""
    samples: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    """Written and read by service.blobs."""
    event: Mapped[Event] = relationship(back_populates="waveforms")
