"""The tables: what was received, what came of it, and who may see it."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import (
    JSON,
    DateTime,
    Dialect,
    ForeignKey,
    Index,
    LargeBinary,
    MetaData,
    Text,
    TypeDecorator,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship

NAMING = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


class UtcDateTime(TypeDecorator[datetime]):
    """Aware times in, UTC out, on databases that forget the zone as well."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """To UTC; a time without a zone is a bug of ours."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise ValueError(f"{value} has no time zone")
        value = value.astimezone(UTC)
        return value.replace(tzinfo=None) if dialect.name == "sqlite" else value

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """From UTC."""
        return None if value is None else value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Base(DeclarativeBase):
    """All tables. Kinds and states are text, so that a new one needs no migration."""

    metadata = MetaData(naming_convention=NAMING)
    type_annotation_map = {  # noqa: RUF012  SQLAlchemy reads it so
        datetime: UtcDateTime,
        dict[str, Any]: JSON(none_as_null=True),
        list[dict[str, Any]]: JSON(none_as_null=True),
        list[str]: JSON(none_as_null=True),
    }


class Building(Base):
    """A building under watch."""

    __tablename__ = "building"
    id: Mapped[int] = mapped_column(primary_key=True)
    code: Mapped[str] = mapped_column(unique=True)
    name: Mapped[str]
    created_at: Mapped[datetime]
    revisions: Mapped[list["Revision"]] = relationship(back_populates="building", order_by="Revision.number")


class Revision(Base):
    """One version of a building's description; results name the one they were made with."""

    __tablename__ = "revision"
    __table_args__ = (UniqueConstraint("building_id", "number"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    number: Mapped[int]
    toml: Mapped[str] = mapped_column(Text)
    folder: Mapped[str]
    """Where the description lay: relative source locations start here."""
    created_at: Mapped[datetime]
    building: Mapped[Building] = relationship(back_populates="revisions")


class SourceState(Base):
    """How far a building's source was read, and how it is doing."""

    __tablename__ = "source_state"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    cursor: Mapped[dict[str, Any]]
    """The source's own: where to go on. What is kept of each file is in `fetched_file`."""
    attempted_at: Mapped[datetime | None]
    succeeded_at: Mapped[datetime | None]
    failing_since: Mapped[datetime | None]
    error: Mapped[str | None] = mapped_column(Text)


class FetchedFile(Base):
    """A file of a building's source, as far as it was taken."""

    __tablename__ = "fetched_file"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    address: Mapped[str] = mapped_column(primary_key=True)
    mark: Mapped[str | None]
    """Tells the version that was taken; None until one was."""
    attempts: Mapped[int]
    """Looks at which it came, but not whole as it seems."""
    version: Mapped[str | None]
    """What the server must still have for the beginning to be of use."""
    beginning: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    """Of a body that broke off."""


class Content(Base):
    """Original bytes, stored once, before anything is read from them."""

    __tablename__ = "content"
    sha256: Mapped[str] = mapped_column(primary_key=True)
    size: Mapped[int]
    data: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)


class Recording(Base):
    """A file or an answer of a server, as it came to a building."""

    __tablename__ = "recording"
    __table_args__ = (UniqueConstraint("building_id", "sha256"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), index=True)
    sha256: Mapped[str | None] = mapped_column(ForeignKey("content.sha256"))
    """None where the bytes were refused before they came: too many."""
    name: Mapped[str]
    origin: Mapped[str]
    """Where it came from: a path or an address."""
    received_at: Mapped[datetime]
    kind: Mapped[str]
    """`waveforms`, `station` or `unknown`."""
    state: Mapped[str]
    """`stored`, `read` or `refused`."""
    reason: Mapped[str | None] = mapped_column(Text)
    failures: Mapped[int] = mapped_column(default=0)
    """Attempts at reading it over which the code failed."""
    version: Mapped[str | None]
    """Of the code that read it, or failed at it."""
    start: Mapped[datetime | None]
    end: Mapped[datetime | None]
    content: Mapped[Content | None] = relationship()


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


class Analysis(Base):
    """What came of analysing an event once; a later analysis makes a new row and keeps this one."""

    __tablename__ = "analysis"
    id: Mapped[int] = mapped_column(primary_key=True)
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True)
    job_id: Mapped[int] = mapped_column(ForeignKey("job.id"), unique=True)
    revision_id: Mapped[int] = mapped_column(ForeignKey("revision.id"))
    current: Mapped[bool]
    """Whether it is the event's latest."""
    created_at: Mapped[datetime]
    version: Mapped[str]
    """Of the code."""
    settings: Mapped[dict[str, Any]]
    inputs: Mapped[list[str]]
    """SHA-256 of every recording it was made from."""
    estimator: Mapped[str | None]
    quality: Mapped[list[dict[str, Any]]]
    refusal: Mapped[str | None] = mapped_column(Text)
    peaks: Mapped[dict[str, Any]]
    """Per channel id, SI units."""
    pga: Mapped[float | None]
    """m/s², the largest horizontal ground acceleration."""
    event: Mapped[Event] = relationship(back_populates="analyses")
    directions: Mapped[list["DirectionResult"]] = relationship(back_populates="analysis")
    layer: Mapped["LayerResult | None"] = relationship(back_populates="analysis")


class DirectionResult(Base):
    """One direction of an analysis, with its histories as blobs (service.blobs)."""

    __tablename__ = "direction_result"
    __table_args__ = (UniqueConstraint("analysis_id", "direction"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    analysis_id: Mapped[int] = mapped_column(ForeignKey("analysis.id"), index=True)
    direction: Mapped[str]
    start: Mapped[datetime]
    rate: Mapped[float]
    count: Mapped[int]
    peak_force: Mapped[float]
    force_std: Mapped[float]
    reliance: Mapped[dict[str, Any] | None]
    """core.reliance.Reliance; None of an estimator that does not judge itself."""
    peak_displacement: Mapped[float | None]
    peak_displacement_std: Mapped[float | None]
    lowest_frequency: Mapped[float | None]
    """Hz, from which on the displacement is good."""
    highest_frequency: Mapped[float | None]
    residual_displacement: Mapped[float | None]
    """None where no transducer measured it."""
    residual_displacement_std: Mapped[float | None]
    displacement: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    velocity: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    displacement_std_history: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    velocity_std_history: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    force: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    force_rigid: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    force_modal: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    force_std_history: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    analysis: Mapped[Analysis] = relationship(back_populates="directions")
    modes: Mapped[list["ModeResult"]] = relationship(back_populates="result", order_by="ModeResult.number")
    cycles: Mapped[list["CycleResult"]] = relationship(back_populates="result", order_by="CycleResult.start")


class LayerResult(Base):
    """What an analysis found of the isolation layer across its directions, with histories as blobs (service.blobs)."""

    __tablename__ = "layer_result"
    id: Mapped[int] = mapped_column(primary_key=True)
    analysis_id: Mapped[int] = mapped_column(ForeignKey("analysis.id"), unique=True)
    start: Mapped[datetime]
    rate: Mapped[float]
    count: Mapped[int]
    peak_resultant: Mapped[float | None]
    """m, of the displacement in x and y; None unless both are known."""
    peak_torsion: Mapped[float | None]
    """rad; None where positions do not tell it."""
    peak_torsion_std: Mapped[float | None]
    torsion_lowest_frequency: Mapped[float | None]
    """Hz, from which on the torsion is good."""
    axial_load_level: Mapped[str | None]
    """Whose vertical acceleration the axial load is from; None where there is none."""
    lowest_axial_load: Mapped[float | None]
    """Over the weight."""
    highest_axial_load: Mapped[float | None]
    torsion: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    torsion_std_history: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    axial_load: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    analysis: Mapped[Analysis] = relationship(back_populates="layer")


class ModeResult(Base):
    """One fixed-base mode of the superstructure."""

    __tablename__ = "mode_result"
    id: Mapped[int] = mapped_column(primary_key=True)
    result_id: Mapped[int] = mapped_column(ForeignKey("direction_result.id"), index=True)
    number: Mapped[int]
    frequency: Mapped[float]
    frequency_std: Mapped[float | None]
    damping_ratio: Mapped[float]
    damping_ratio_std: Mapped[float | None]
    shape: Mapped[dict[str, Any]]
    """By level name."""
    shape_std: Mapped[dict[str, Any] | None]
    misfit: Mapped[float | None]
    """Chi-square per degree of freedom."""
    result: Mapped[DirectionResult] = relationship(back_populates="modes")


class CycleResult(Base):
    """Equivalent stiffness and damping over one cycle."""

    __tablename__ = "cycle_result"
    id: Mapped[int] = mapped_column(primary_key=True)
    result_id: Mapped[int] = mapped_column(ForeignKey("direction_result.id"), index=True)
    start: Mapped[float]
    """s after the record's start."""
    end: Mapped[float]
    amplitude: Mapped[float]
    shear_strain: Mapped[float | None]
    k_eq: Mapped[float]
    k_eq_std: Mapped[float]
    c_eq: Mapped[float]
    c_eq_std: Mapped[float]
    result: Mapped[DirectionResult] = relationship(back_populates="cycles")


class ApiKey(Base):
    """Who may use the API; the key itself is never stored."""

    __tablename__ = "api_key"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    role: Mapped[str]
    """`viewer`, `engineer` or `admin`."""
    hash: Mapped[str] = mapped_column(unique=True)
    created_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]


class Lease(Base):
    """A right that one process holds at a time, such as polling."""

    __tablename__ = "lease"
    name: Mapped[str] = mapped_column(primary_key=True)
    holder: Mapped[str]
    until: Mapped[datetime]
