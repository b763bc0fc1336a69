"""The tables of who may use the API, and who is logged in."""

from datetime import datetime
from typing import Any

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column, relationship

from service.db.base import Base


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


class LoginSession(Base):
    """A browser that is logged in; its cookie is a random number, of which only the hash is stored."""

    __tablename__ = "login_session"
    id: Mapped[int] = mapped_column(primary_key=True)
    hash: Mapped[str] = mapped_column(unique=True)
    key_id: Mapped[int | None] = mapped_column(ForeignKey("api_key.id", ondelete="CASCADE"), index=True)
    """None where a login link began it, which makes an admin."""
    created_at: Mapped[datetime]
    used_at: Mapped[datetime]
    """The last use, to a minute or so."""
    ended_at: Mapped[datetime | None]
    key: Mapped[ApiKey | None] = relationship()


class LoginLink(Base):
    """A link that logs an admin in, once; its token is never stored."""

    __tablename__ = "login_link"
    id: Mapped[int] = mapped_column(primary_key=True)
    hash: Mapped[str] = mapped_column(unique=True)
    created_at: Mapped[datetime]
    used_at: Mapped[datetime | None]


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
