"""The table of what people did."""

from datetime import datetime
from typing import Any

from sqlalchemy.orm import Mapped, mapped_column

from service.database.base import Base


class AuditEntry(Base):
    """Something that a person changed, through the API, a page or a command; written with the change or not at all."""

    __tablename__ = "audit_entry"
    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(index=True)
    by: Mapped[str]
    """Name of the key, or of the account that gave the command."""
    address: Mapped[str]
    """From where: an address, or the name of the machine for a command."""
    action: Mapped[str]
    """`POST`, `PUT`, ..., or the command, such as `menshin building add`."""
    target: Mapped[str]
    """What it was done to: a path of the API or a page; empty for a command."""
    details: Mapped[dict[str, Any]]
    """What was asked for, or the command's arguments, without secrets."""
