"""Tables of analyses and their results."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, LargeBinary, Text, UniqueConstraint, text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.db.base import Base
from service.records.tables import Event

DELETED = b"f"
"""In place of a history that a direction must have, once retention has deleted it: a history without samples, as
service.db.blobs encodes it."""


class Analysis(Base):
    """One analysis of an event; a later one makes a new row and keeps this one."""

    __tablename__ = "analysis"
    __table_args__ = (
        Index(
            "uq_analysis_current",
            "event_id",
            unique=True,
            sqlite_where=text("current = 1"),
            postgresql_where=text("current"),
        ),
        Index(
            "ix_analysis_refused",
            "event_id",
            sqlite_where=text("refusal IS NOT NULL"),
            postgresql_where=text("refusal IS NOT NULL"),
        ),
    )
    id: Mapped[int] = mapped_column(primary_key=True)
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True)
    job_id: Mapped[int] = mapped_column(ForeignKey("job.id"), unique=True)
    revision_id: Mapped[int] = mapped_column(ForeignKey("revision.id"))
    current: Mapped[bool]
    """True for the event's latest."""
    created_at: Mapped[datetime]
    version: Mapped[str]
    """Version of the code."""
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
    temperature: Mapped[float | None]
    """°C, mean of what thermometers measured."""
    event: Mapped[Event] = relationship()
    directions: Mapped[list["DirectionResult"]] = relationship(back_populates="analysis")
    layer: Mapped["LayerResult | None"] = relationship(back_populates="analysis")
    sensors: Mapped[list["SensorResult"]] = relationship(back_populates="analysis", order_by="SensorResult.channel")
    shaking: Mapped["ShakingResult | None"] = relationship(back_populates="analysis")


class DirectionResult(Base):
    """One direction of an analysis, with its histories as blobs (service.db.blobs)."""

    __tablename__ = "direction_result"
    __table_args__ = (UniqueConstraint("analysis_id", "direction"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    analysis_id: Mapped[int] = mapped_column(ForeignKey("analysis.id"))
    direction: Mapped[str]
    start: Mapped[datetime]
    rate: Mapped[float]
    count: Mapped[int]
    peak_force: Mapped[float]
    force_std: Mapped[float]
    assessment: Mapped[dict[str, Any] | None]
    """core.estimators.result.Assessment; None of an estimator that does not assess itself."""
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
    """The isolation layer across an analysis' directions, with histories as blobs (service.db.blobs)."""

    __tablename__ = "layer_result"
    id: Mapped[int] = mapped_column(primary_key=True)
    analysis_id: Mapped[int] = mapped_column(ForeignKey("analysis.id"), unique=True)
    start: Mapped[datetime]
    rate: Mapped[float]
    count: Mapped[int]
    peak_resultant: Mapped[float | None]
    """m, of the displacement in x and y; None unless both are known."""
    peak_torsion: Mapped[float | None]
    """rad; None if positions do not determine it."""
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


class ShakingResult(Base):
    """Strength of the earthquake at the building, and peaks of the floors; earlier versions stored none."""

    __tablename__ = "shaking_result"
    id: Mapped[int] = mapped_column(primary_key=True)
    analysis_id: Mapped[int] = mapped_column(ForeignKey("analysis.id"), unique=True)
    level: Mapped[str]
    """The lowest level with an accelerometer."""
    is_below_isolators: Mapped[bool]
    components: Mapped[list[str]]
    """Directions of its accelerometers."""
    pga: Mapped[float]
    """m/s², largest horizontal acceleration."""
    pgv: Mapped[float]
    """m/s, largest horizontal velocity."""
    intensity: Mapped[float | None]
    """JMA instrumental intensity, unofficial; None without motion."""
    long_period_velocity: Mapped[float]
    """m/s, which gives the class of long-period motion."""
    arias: Mapped[float]
    """m/s."""
    duration: Mapped[float]
    """s, from 5 to 95 % of the Arias intensity."""
    spectrum: Mapped[dict[str, Any]]
    """m/s² by direction, at core.shaking.measures.SPECTRUM_PERIODS."""
    floors: Mapped[list[dict[str, Any]]]
    """core.shaking.floors.FloorAcceleration of every level and direction."""
    storeys: Mapped[list[dict[str, Any]]]
    """core.shaking.floors.StoreyDisplacement of every storey and direction."""
    peak_floor_acceleration: Mapped[float | None]
    """m/s², the largest of `floors`."""
    peak_storey_displacement: Mapped[float | None]
    """m, the largest of `storeys`."""
    travel: Mapped[float | None]
    """m, length of the isolation layer's path in plan; None unless both directions are known."""
    analysis: Mapped[Analysis] = relationship(back_populates="shaking")


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


class SensorResult(Base):
    """State of one channel in an event (core.sensors.sensor_errors)."""

    __tablename__ = "sensor_result"
    __table_args__ = (UniqueConstraint("analysis_id", "channel"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    analysis_id: Mapped[int] = mapped_column(ForeignKey("analysis.id"))
    channel: Mapped[str]
    noise: Mapped[float | None]
    """SI units, standard deviation at rest."""
    gain: Mapped[float | None]
    """Over that of the other sensors of its direction."""
    gain_std: Mapped[float | None]
    analysis: Mapped[Analysis] = relationship(back_populates="sensors")
