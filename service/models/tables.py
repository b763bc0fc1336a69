"""Tables of the models of the isolation layer, their comparisons and diagnoses."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Index, LargeBinary, Text, UniqueConstraint, column, null
from sqlalchemy.orm import Mapped, column_property, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base
from service.records.tables import Event

CURRENT = column("state") == "current"


class ModelVersion(Base):
    """One version of a building's model in a direction; a change makes the next one and keeps this.

    Effects are stored by name, so that a new one needs no migration and an unknown one in an old row still displays.
    """

    __tablename__ = "model_version"
    __table_args__ = (
        UniqueConstraint("building_id", "direction", "number"),
        Index(
            "uq_model_version_current",
            "building_id",
            "direction",
            unique=True,
            sqlite_where=CURRENT,
            postgresql_where=CURRENT,
        ),
    )
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    direction: Mapped[str]
    """`x`, `y` or `xy`."""
    number: Mapped[int]
    parent_id: Mapped[int | None] = mapped_column(ForeignKey("model_version.id"))
    state: Mapped[str]
    """`draft`, `current` (at most one of a building and direction) or `retired`."""
    change: Mapped[str] = mapped_column(Text)
    """Change against the parent, and its reason."""
    author: Mapped[str]
    """Name of the key that requested it."""
    created_at: Mapped[datetime]
    accepted_by: Mapped[str | None]
    """Name of the key that last made it current; None of a draft."""
    accepted_at: Mapped[datetime | None]
    version: Mapped[str]
    """Version of the code."""
    revision_id: Mapped[int] = mapped_column(ForeignKey("revision.id"))
    reference: Mapped[datetime | None]
    """From which effects count time; None as long as nothing was fitted."""
    effects: Mapped[dict[str, Any]]
    """Value of every parameter, by effect."""
    standard_deviations: Mapped[dict[str, Any]]
    """Standard deviations of the fitted parameters, by effect; None where the records did not determine one."""
    assumed: Mapped[list[str]]
    """Parameters that were neither given nor measured."""
    outcome: Mapped[str | None] = mapped_column(Text)
    """Outcome of the fit, and the parameters that it could not determine, in words; None where nothing was fitted."""
    building: Mapped[Building] = relationship()
    comparisons: Mapped[list["ModelComparison"]] = relationship(back_populates="model", order_by="ModelComparison.id")


class ModelComparison(Base):
    """A version of a model compared with one analysed event in one direction."""

    __tablename__ = "model_comparison"
    __table_args__ = (UniqueConstraint("model_id", "analysis_id", "direction"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    model_id: Mapped[int] = mapped_column(ForeignKey("model_version.id"))
    event_id: Mapped[int] = mapped_column(ForeignKey("event.id"), index=True)
    analysis_id: Mapped[int] = mapped_column(ForeignKey("analysis.id"), index=True)
    direction: Mapped[str]
    role: Mapped[str]
    """`fitted`, `held_out`, or `later`: known to neither the fit nor the choice of effects."""
    created_at: Mapped[datetime]
    version: Mapped[str]
    """Version of the code."""
    misfit: Mapped[dict[str, Any]]
    """core.comparison.misfit.Misfit of the force, N, the model driven by the measured motion."""
    displacement: Mapped[dict[str, Any] | None]
    """The same of the layer's displacement, m, driven by the ground alone; None where nothing measured the ground."""
    accelerations: Mapped[dict[str, Any] | None]
    """The same of the accelerations, m/s², by level."""
    force: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    """N, the model's for the measured motion, at the analysis' samples (service.db.blobs)."""
    model: Mapped[ModelVersion] = relationship(back_populates="comparisons")
    event: Mapped[Event] = relationship()


class KeptEffect(Base):
    """A sketched law that is kept as an effect of every model: its values, from which its code is written.

    It names the sketch that it came from by numbers alone, which outlive the rows.
    """

    __tablename__ = "kept_effect"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    law: Mapped[dict[str, Any]]
    """service.models.sketch_results.LawOut."""
    building: Mapped[str]
    """Code of the building whose records were sketched."""
    model_id: Mapped[int]
    job_id: Mapped[int]
    """Number of the sketch."""
    author: Mapped[str]
    """Name of the key that kept it."""
    created_at: Mapped[datetime]
    version: Mapped[str]
    """Version of the code."""


class ModelDiagnosis(Base):
    """A diagnosis of a version; another diagnosis makes a new row and keeps this one."""

    __tablename__ = "model_diagnosis"
    id: Mapped[int] = mapped_column(primary_key=True)
    model_id: Mapped[int] = mapped_column(ForeignKey("model_version.id"), index=True)
    job_id: Mapped[int] = mapped_column(ForeignKey("job.id"), unique=True)
    revision_id: Mapped[int] = mapped_column(ForeignKey("revision.id"))
    author: Mapped[str]
    """Name of the key that requested it."""
    created_at: Mapped[datetime]
    version: Mapped[str]
    """Version of the code."""
    fitted: Mapped[list[int]]
    """Numbers of the events that candidates were fitted to."""
    held_out: Mapped[list[int]]
    analyses: Mapped[list[int]]
    """Numbers of the analyses of all of them."""
    outcome: Mapped[str]
    """Outcome, see core.workbench.diagnosis_result."""
    sentences: Mapped[list[str]]
    """The same and more, in words."""
    document: Mapped[dict[str, Any]] = mapped_column(deferred=True)
    """All of it, see service.models.results.DiagnosisDocument."""
    model: Mapped[ModelVersion] = relationship()
    pictures: Mapped[list["DiagnosisPicture"]] = relationship(
        back_populates="diagnosis", order_by="DiagnosisPicture.id"
    )


class DiagnosisPicture(Base):
    """One chart of a diagnosis; an earlier version stored a picture of it instead of the specification."""

    __tablename__ = "diagnosis_picture"
    id: Mapped[int] = mapped_column(primary_key=True)
    diagnosis_id: Mapped[int] = mapped_column(ForeignKey("model_diagnosis.id"), index=True)
    title: Mapped[str]
    caption: Mapped[str] = mapped_column(Text)
    svg: Mapped[str | None] = mapped_column(Text, deferred=True)
    spec: Mapped[dict[str, Any] | None] = mapped_column(deferred=True)
    """Specification for Vega-Lite, with its data."""
    is_live: Mapped[bool] = column_property(spec.is_not(null()))
    """True if it has a specification."""
    diagnosis: Mapped[ModelDiagnosis] = relationship(back_populates="pictures")
