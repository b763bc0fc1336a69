"""The table of who may use the API."""

from datetime import datetime

from sqlalchemy.orm import Mapped, mapped_column

from service.database.base import Base


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
