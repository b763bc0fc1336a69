"""Tables of sources, recordings, events and waveforms."""

from datetime import datetime
from typing import Any

from sqlalchemy import BigInteger, ForeignKey, Index, Integer, LargeBinary, Text, UniqueConstraint, false, text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base

READ, REJECTED = text("recording.state = 'read'"), text("recording.state = 'refused'")
STORED = text("recording.state = 'stored'")
"""Written out in queries, because SQLite uses a partial index only for a literal."""


def _index_of_state(state: str, column: str) -> Index:
    """Index of a building's recordings in one state by a further column."""
    where = text(f"state = '{state}'")
    return Index(f"ix_recording_{state}", "building_id", column, sqlite_where=where, postgresql_where=where)


class SourceState(Base):
    """Position in a building's source, and the source's state."""

    __tablename__ = "source_state"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    cursor: Mapped[dict[str, Any]]
    """The source's own: where to go on. What is kept of each file is in `fetched_file`."""
    attempted_at: Mapped[datetime | None]
    looked_at: Mapped[datetime | None]
    """Time when a poll last returned data or ended, successful or not."""
    succeeded_at: Mapped[datetime | None]
    failing_since: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Text)
    clock_ahead: Mapped[float | None]
    """s, lead of the server's clock over this machine's at the last successful poll; None if the server does not state
    it."""


class FetchedFile(Base):
    """A file of a building's source, as far as it was fetched."""

    __tablename__ = "fetched_file"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    address: Mapped[str] = mapped_column(primary_key=True)
    mark: Mapped[str | None]
    """Version that was fetched; None until one was."""
    attempts: Mapped[int]
    """Polls at which it was returned but seemed incomplete."""
    version: Mapped[str | None]
    """Version that the server must still have for the beginning to be usable."""
    beginning: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    """Beginning of a body that broke off."""


class Packet(Base):
    """A packet of a building's live stream, kept for `stream.keep` seconds."""

    __tablename__ = "packet"
    __table_args__ = (UniqueConstraint("building_id", "sha256"), Index(None, "building_id", "end"))
    id: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True)
    """Rises in the order in which the packets came."""
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    station: Mapped[str]
    """Network and station, as the server names it: XX_TOWER."""
    sequence: Mapped[int | None] = mapped_column(BigInteger)
    """The server's number of the packet; None where it gave none."""
    channel: Mapped[str]
    """Empty where the header cannot be read."""
    start: Mapped[datetime]
    """Time of its first sample; of its arrival where the header cannot be read."""
    end: Mapped[datetime]
    received_at: Mapped[datetime]
    reason: Mapped[str | None] = mapped_column(Text)
    """Why it cannot be used."""
    sha256: Mapped[str]
    data: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)


class StreamState(Base):
    """State of a building's live stream; the position in it is the cursor of `source_state`."""

    __tablename__ = "stream_state"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    protocol: Mapped[str | None]
    """Version of SeedLink that the server speaks: 3 or 4."""
    connected_since: Mapped[datetime | None]
    """None while there is no connection."""
    received_at: Mapped[datetime | None]
    """Time of the last packet's arrival."""
    packets: Mapped[int] = mapped_column(BigInteger)
    """Number that came, without doubles."""
    doubles: Mapped[int] = mapped_column(BigInteger)
    """Number that came again."""
    refused: Mapped[int] = mapped_column(BigInteger)
    """Number that could not be used."""
    problem: Mapped[str | None] = mapped_column(Text)
    """Why the last of these could not."""
    channels: Mapped[dict[str, Any]]
    """Flow of each channel, by id: `reached`, `arrived`, `gaps`, `missing` and `has_sent`; see
    service.records.streams.flow."""
    silent: Mapped[dict[str, Any] | None]
    """Time since which each silent channel is silent while others send, by id; None if none is."""
    looked: Mapped[int] = mapped_column(BigInteger)
    """Id of the last packet that the trigger has seen."""
    shaking: Mapped[list[dict[str, Any]]]
    """Earthquakes that are not over, as service.records.streams.earthquakes writes them."""
    cuts: Mapped[list[dict[str, Any]]]
    """Earthquakes that were cut out, as service.records.streams.earthquakes writes them."""


class Content(Base):
    """Original bytes, stored once, before anything is read from them; service.records.originals writes and reads them.

    The row outlives the bytes, so that a result can always be traced to their SHA-256.
    """

    __tablename__ = "content"
    sha256: Mapped[str] = mapped_column(primary_key=True)
    size: Mapped[int]
    data: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    """Empty where they are outside, or deleted."""
    is_outside: Mapped[bool] = mapped_column(default=False, server_default=false())
    """True if they are in the store of `storage.originals`, or still have to be deleted there."""
    deleted_at: Mapped[datetime | None]
    deleted_by: Mapped[str | None]
    """Setting that allowed the deletion, such as `retention.original_files`."""


class Recording(Base):
    """A file or a server's response, as received for a building."""

    __tablename__ = "recording"
    __table_args__ = (
        UniqueConstraint("building_id", "sha256"),
        _index_of_state("read", "end"),
        _index_of_state("refused", "received_at"),
        _index_of_state("stored", "id"),
    )
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    sha256: Mapped[str | None] = mapped_column(ForeignKey("content.sha256"), index=True)
    """None if the bytes were refused before they were fetched, because there were too many."""
    name: Mapped[str]
    origin: Mapped[str]
    """Origin: a path or an address."""
    received_at: Mapped[datetime]
    kind: Mapped[str]
    """`waveforms`, `station` or `unknown`."""
    state: Mapped[str]
    """`stored`, `read` or `refused`."""
    reason: Mapped[str | None] = mapped_column(Text)
    failures: Mapped[int] = mapped_column(default=0)
    """Attempts at which the code failed."""
    version: Mapped[str | None]
    """Version of the code that read it, or failed."""
    start: Mapped[datetime | None]
    """Start of its samples; None if it was refused. If it was refused as of the future, it is read again after it."""
    end: Mapped[datetime | None]
    content: Mapped[Content | None] = relationship()
    building: Mapped[Building] = relationship()


class Event(Base):
    """One earthquake at one building."""

    __tablename__ = "event"
    __table_args__ = (
        Index(None, "building_id", "start"),
        Index(None, "building_id", "updated_at"),
        Index(None, "state", "updated_at"),
    )
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    start: Mapped[datetime]
    end: Mapped[datetime]
    state: Mapped[str]
    """`gathering` (files may be missing), `queued`, `analysed`, `refused` or `failed`."""
    reason: Mapped[str | None] = mapped_column(Text)
    """Reason of the rejection, or the failure."""
    recorded_peak: Mapped[float | None]
    """m/s², largest acceleration of any channel as recorded, which decides what is analysed first; None where no
    accelerometer recorded, or an earlier version stored it."""
    created_at: Mapped[datetime]
    updated_at: Mapped[datetime]
    building: Mapped[Building] = relationship()
    waveforms: Mapped[list["Waveform"]] = relationship(back_populates="event", order_by="Waveform.channel")


class EventRecording(Base):
    """Assignment of recordings to the events cut from them."""

    __tablename__ = "event_recording"
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), primary_key=True)
    recording_id: Mapped[int] = mapped_column(ForeignKey("recording.id"), primary_key=True, index=True)


class RecordedChannel(Base):
    """A channel of which a building has recorded a waveform, and when: one row, however many there are."""

    __tablename__ = "recorded_channel"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    channel: Mapped[str] = mapped_column(primary_key=True)
    station: Mapped[str]
    """The channel's network and station, such as `XX.TWR`."""
    start: Mapped[datetime]
    """Time of the first sample."""
    end: Mapped[datetime]
    """Time of the last sample. Where the migration filled this column, the end of the last earthquake."""


class Waveform(Base):
    """One channel of one event, as recorded: one compressed blob, not a row per sample."""

    __tablename__ = "waveform"
    __table_args__ = (UniqueConstraint("event_id", "channel", "start"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"))
    channel: Mapped[str]
    start: Mapped[datetime]
    rate: Mapped[float]
    count: Mapped[int]
    gain: Mapped[float]
    """SI units per stored number."""
    samples: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    """Written and read by service.db.blobs."""
    event: Mapped[Event] = relationship(back_populates="waveforms")
