"""Tables of keys, browser sessions, login links, links to a building and the audit trail."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.buildings.tables import Building
from service.db.base import Base


class ApiKey(Base):
    """An API key; only its digest is stored."""

    __tablename__ = "api_key"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(unique=True)
    role: Mapped[str]
    """`viewer`, `engineer` or `admin`: the role on every building of the key."""
    higher: Mapped[dict[str, Any] | None]
    """Higher roles on single buildings by their codes; None without any."""
    hash: Mapped[str] = mapped_column(unique=True)
    buildings: Mapped[list[str] | None]
    """Codes of the buildings that exist for the key; None for all."""
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]
    used_at: Mapped[datetime | None]
    """Time of the last use, to about a minute."""


class LoginSession(Base):
    """A browser session; only the hash of its cookie, a random number, is stored."""

    __tablename__ = "login_session"
    id: Mapped[int] = mapped_column(primary_key=True)
    hash: Mapped[str] = mapped_column(unique=True)
    key_id: Mapped[int | None] = mapped_column(ForeignKey("api_key.id", ondelete="CASCADE"), index=True)
    """None for a session of a person, and for one from a login link, whose role is admin."""
    issuer: Mapped[str | None]
    """Sign-in provider of a person; None for every other session."""
    person: Mapped[str | None]
    """Name of the person."""
    groups: Mapped[list[str] | None]
    """The person's groups at the provider, which the settings map to roles."""
    sign_in: Mapped[str | None] = mapped_column(unique=True)
    """Digest of the state by which the person signed in: it counts once."""
    expires_at: Mapped[datetime | None]
    """End of a person's session, whatever its use."""
    created_at: Mapped[datetime]
    used_at: Mapped[datetime]
    """Time of the last use, to about a minute."""
    ended_at: Mapped[datetime | None]
    key: Mapped[ApiKey | None] = relationship()


class BuildingLink(Base):
    """A link by which whoever has it reads the pages of one building; its token is not stored."""

    __tablename__ = "building_link"
    id: Mapped[int] = mapped_column(primary_key=True)
    building_id: Mapped[int] = mapped_column(ForeignKey("building.id"), index=True)
    name: Mapped[str]
    """Person or purpose that it is for."""
    hash: Mapped[str] = mapped_column(unique=True)
    created_by: Mapped[str]
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]
    revoked_at: Mapped[datetime | None]
    used_at: Mapped[datetime | None]
    """Time of the last use, to about a minute."""
    building: Mapped[Building] = relationship()


class LoginLink(Base):
    """A link that logs an admin in once; its token is not stored."""

    __tablename__ = "login_link"
    id: Mapped[int] = mapped_column(primary_key=True)
    hash: Mapped[str] = mapped_column(unique=True)
    created_at: Mapped[datetime]
    used_at: Mapped[datetime | None]


class AuditEntry(Base):
    """A change by a person through the API, a page or a command; stored in the transaction of the change."""

    __tablename__ = "audit_entry"
    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[datetime] = mapped_column(index=True)
    by: Mapped[str]
    """Name of the key, or of the account that ran the command."""
    address: Mapped[str]
    """Origin: an address, or the name of the machine for a command."""
    action: Mapped[str]
    """HTTP method, or the command, such as `menshin building add`."""
    target: Mapped[str]
    """Object of the change: a path of the API or a page; empty for a command."""
    details: Mapped[dict[str, Any]]
    """Body of the request, or the command's arguments, without secrets."""
