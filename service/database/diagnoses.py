"""Tables of what versions of models lack, by events."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.database.base import Base
from service.database.models import ModelVersion


class ModelDiagnosis(Base):
    """What a version of a model was found to lack; another diagnosis makes a new row and keeps this one."""

    __tablename__ = "model_diagnosis"
    id: Mapped[int] = mapped_column(primary_key=True)
    model_id: Mapped[int] = mapped_column(ForeignKey("model_version.id"), index=True)
    job_id: Mapped[int] = mapped_column(ForeignKey("job.id"), unique=True)
    revision_id: Mapped[int] = mapped_column(ForeignKey("revision.id"))
    author: Mapped[str]
    """Name of the key that asked for it."""
    created_at: Mapped[datetime]
    version: Mapped[str]
    """Of the code."""
    fitted: Mapped[list[int]]
    """Numbers of the events that candidates were fitted to."""
    left_out: Mapped[list[int]]
    analyses: Mapped[list[int]]
    """Numbers of the analyses of all of them."""
    outcome: Mapped[str]
    """See service.workbench.diagnosing."""
    sentences: Mapped[list[str]]
    """The same and more, in words."""
    document: Mapped[dict[str, Any]] = mapped_column(deferred=True)
    """All of it, see service.workbench.diagnosis_json."""
    model: Mapped[ModelVersion] = relationship()
    pictures: Mapped[list["DiagnosisPicture"]] = relationship(
        back_populates="diagnosis", order_by="DiagnosisPicture.id"
    )


class DiagnosisPicture(Base):
    """One picture of a diagnosis."""

    __tablename__ = "diagnosis_picture"
    id: Mapped[int] = mapped_column(primary_key=True)
    diagnosis_id: Mapped[int] = mapped_column(ForeignKey("model_diagnosis.id"), index=True)
    title: Mapped[str]
    caption: Mapped[str] = mapped_column(Text)
    svg: Mapped[str] = mapped_column(Text, deferred=True)
    diagnosis: Mapped[ModelDiagnosis] = relationship(back_populates="pictures")
