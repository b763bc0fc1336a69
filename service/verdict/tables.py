"""The table of the buildings' levels, by which a list of buildings is sorted and counted."""

from datetime import datetime

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from service.db.base import Base


class BuildingLevel(Base):
    """The level of a building when its facts last changed, and where the building stands.

    A page shows verdicts that are assessed as it is read; this row decides its order and the counts of all buildings.
    """

    __tablename__ = "building_level"
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), primary_key=True)
    level: Mapped[str]
    """One of service.verdict.checks.Level."""
    rank: Mapped[int] = mapped_column(index=True)
    """0 for normal, 5 for act."""
    latitude: Mapped[float | None]
    longitude: Mapped[float | None]
    """°; None where the building file gives none."""
    assessed_at: Mapped[datetime]
