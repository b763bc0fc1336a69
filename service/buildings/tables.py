"""Tables of the buildings and their descriptions."""

from datetime import datetime

from sqlalchemy import ForeignKey, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.db.base import Base
from service.db.encryption import Encrypted


class Building(Base):
    """A building."""

    __tablename__ = "building"
    id: Mapped[int] = mapped_column(primary_key=True)
    code: Mapped[str] = mapped_column(unique=True)
    name: Mapped[str]
    latitude: Mapped[float | None]
    longitude: Mapped[float | None]
    """Degrees, from the latest description. None where it gives none, or where a row from before these columns had no
    check."""
    created_at: Mapped[datetime]
    revisions: Mapped[list["Revision"]] = relationship(back_populates="building", order_by="Revision.number")


class Revision(Base):
    """One version of a building's description; results name the one they were made with."""

    __tablename__ = "revision"
    __table_args__ = (UniqueConstraint("building_id", "number"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"))
    number: Mapped[int]
    toml: Mapped[str] = mapped_column(Encrypted)
    """It may hold passwords of sources and secrets of receivers."""
    parsed: Mapped[str | None] = mapped_column(Encrypted)
    """The same as JSON, of service.buildings.description.stored; None of revisions from before it was stored."""
    folder: Mapped[str]
    """Folder of the description: relative source locations start here."""
    created_at: Mapped[datetime]
    building: Mapped[Building] = relationship(back_populates="revisions")
