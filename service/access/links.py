"""Links by which whoever has one reads the pages of one building, until the link ends or is revoked."""

from collections.abc import Sequence
from datetime import datetime, timedelta

from sqlalchemy import select, update
from sqlalchemy.orm import Session, joinedload

from service.access.roles import Caller, Role, digest, new_secret
from service.access.tables import BuildingLink
from service.buildings.tables import Building
from service.errors import NotFoundError

DAYS, MOST_DAYS = 30, 366
"""Days until a link ends, by default and at most: a link is passed on, so that none lasts for ever. Not tuned."""


def create(
    session: Session, building: Building, name: str, by: str, now: datetime, days: int = DAYS
) -> tuple[BuildingLink, str]:
    """A new link and its token, which is not stored and cannot be shown again.

    Args:
        session: to write with.
        building: that the link shows.
        name: person or purpose that it is for.
        by: name of the caller who makes it.
        now: the time.
        days: until it ends, 1 to MOST_DAYS.
    """
    token = new_secret("mv")
    times = {"created_at": now, "expires_at": now + timedelta(days=days)}
    link = BuildingLink(building_id=building.id, name=name, hash=digest(token), created_by=by, **times)
    session.add(link)
    session.flush()
    return link, token


def address(public: str, token: str) -> str:
    """Address of a link, on the service at a public address."""
    return f"{public.rstrip('/')}/link?token={token}"


def every(session: Session, building_id: int | None = None) -> Sequence[BuildingLink]:
    """Links to one building, or all, the latest first; ended and revoked ones too."""
    query = select(BuildingLink).options(joinedload(BuildingLink.building)).order_by(BuildingLink.id.desc())
    return session.scalars(query if building_id is None else query.where(BuildingLink.building_id == building_id)).all()


def revoke(session: Session, link_id: int, now: datetime) -> BuildingLink:
    """Revoke a link, and with it every browser that reads by it; revoking it again changes nothing.

    Raises:
        NotFoundError: there is no such link.
    """
    link = session.get(BuildingLink, link_id)
    if link is None:
        raise NotFoundError("link", link_id)
    link.revoked_at = link.revoked_at or now
    return link


def valid(session: Session, now: datetime) -> Sequence[BuildingLink]:
    """Links that have not ended and are not revoked, with their buildings."""
    lasts = (BuildingLink.revoked_at.is_(None), BuildingLink.expires_at > now)
    return session.scalars(select(BuildingLink).options(joinedload(BuildingLink.building)).where(*lasts)).all()


def caller(link: BuildingLink) -> Caller:
    """The caller by a link: a viewer of its building."""
    return Caller(f"link:{link.name}", Role.viewer, frozenset({link.building.code}), link.expires_at)


def touch(session: Session, token_digest: str, now: datetime) -> None:
    """Note that the link was used."""
    session.execute(update(BuildingLink).where(BuildingLink.hash == token_digest).values(used_at=now))
