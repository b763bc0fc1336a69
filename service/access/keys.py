"""API keys: creation, listing and revocation, and the keys and logins that are valid."""

from collections.abc import Collection, Sequence
from datetime import datetime

from sqlalchemy import ColumnElement, and_, or_, select, update
from sqlalchemy.orm import Session, joinedload

from service.access import logins
from service.access.roles import Role, digest, new_secret, soon_in_words
from service.access.tables import ApiKey, LoginSession
from service.buildings.tables import Building


class KeyNameError(Exception):
    """The name of a key is in use or unknown, or the key would be of no use."""


def create(
    session: Session,
    name: str,
    role: Role,
    now: datetime,
    *,
    buildings: Collection[str] | None = None,
    expires_at: datetime | None = None,
) -> str:
    """A new key; it is not stored and cannot be shown again.

    Args:
        session: to write with.
        name: of the key.
        role: of the key.
        now: the time.
        buildings: codes of the buildings that exist for the key; None for all.
        expires_at: when the key ends; None: only when it is revoked.

    Raises:
        KeyNameError: the name is in use, or was that of a revoked key: names are never used again; or a building is
            unknown, or the end is not in the future.
    """
    if _find(session, name) is not None:
        raise KeyNameError(f"There is a key {name!r} already; choose another name.")
    if expires_at is not None and expires_at <= now:
        raise KeyNameError(f"The key would end at {expires_at:%Y-%m-%d %H:%M} UTC, which has passed.")
    codes = None if buildings is None else sorted(set(buildings))
    if codes is not None:
        _check_codes(session, codes)
    key = new_secret("mk")
    row = ApiKey(name=name, role=role.name, hash=digest(key), buildings=codes, created_at=now, expires_at=expires_at)
    session.add(row)
    return key


def _check_codes(session: Session, codes: Collection[str]) -> None:
    """Refuse unknown buildings, which would never be found."""
    known = set(session.scalars(select(Building.code).where(Building.code.in_(codes))))
    if unknown := sorted(set(codes) - known):
        raise KeyNameError(f"There is no building {unknown[0]!r}; 'menshin building list' shows their codes.")


def every(session: Session) -> Sequence[ApiKey]:
    """All keys, revoked ones too, by name."""
    return session.scalars(select(ApiKey).order_by(ApiKey.name)).all()


def end_in_words(key: ApiKey, now: datetime) -> str:
    """The end of a key, past or future; one that is near is marked."""
    if key.revoked_at is not None:
        return f"revoked {time_in_words(key.revoked_at)}"
    if key.expires_at is None:
        return "never"
    end = time_in_words(key.expires_at)
    if key.expires_at <= now:
        return f"expired {end}"
    return f"{end}, {soon}" if (soon := soon_in_words(key.expires_at, now)) else end


def time_in_words(moment: datetime | None, otherwise: str = "") -> str:
    """A time to the minute."""
    return otherwise if moment is None else f"{moment:%Y-%m-%d %H:%M}"


def revoke(session: Session, name: str, now: datetime) -> None:
    """Revoke a key and end its browser sessions; revoking it again changes nothing.

    Raises:
        KeyNameError: no key has that name.
    """
    key = _find(session, name)
    if key is None:
        raise KeyNameError(f"There is no key {name!r}; 'menshin key list' shows them.")
    key.revoked_at = key.revoked_at or now
    logins.end_all(session, key.id, now)


def log_out(session: Session, name: str | None, now: datetime) -> int:
    """End all browser sessions, or those of one key; the number of valid ones that were ended.

    Raises:
        KeyNameError: no key has that name.
    """
    if name is None:
        return logins.end_all(session, None, now)
    key = _find(session, name)
    if key is None:
        raise KeyNameError(f"There is no key {name!r}; 'menshin key list' shows them.")
    return logins.end_all(session, key.id, now)


def valid_keys(session: Session, now: datetime) -> Sequence[ApiKey]:
    """Keys that are neither revoked nor expired."""
    return session.scalars(select(ApiKey).where(*is_valid(now))).all()


def is_valid(now: datetime) -> tuple[ColumnElement[bool], ...]:
    """The conditions of a valid key."""
    return (ApiKey.revoked_at.is_(None), or_(ApiKey.expires_at.is_(None), ApiKey.expires_at > now))


def touch(session: Session, key_digest: str, now: datetime) -> None:
    """Note that the key was used."""
    session.execute(update(ApiKey).where(ApiKey.hash == key_digest).values(used_at=now))


def has_had_keys(session: Session) -> bool:
    """True if any key was ever created, revoked ones included."""
    return session.scalar(select(ApiKey.id).limit(1)) is not None


def valid_logins(
    session: Session, now: datetime, used_after: datetime, created_after: datetime
) -> Sequence[LoginSession]:
    """Valid browser sessions with their keys: not ended, idle or expired, and with a valid key."""
    query = select(LoginSession).outerjoin(LoginSession.key).options(joinedload(LoginSession.key))
    living = (
        LoginSession.ended_at.is_(None),
        LoginSession.used_at > used_after,
        LoginSession.created_at > created_after,
        or_(LoginSession.key_id.is_(None), and_(*is_valid(now))),
    )
    return session.scalars(query.where(*living)).all()


def _find(session: Session, name: str) -> ApiKey | None:
    return session.scalars(select(ApiKey).where(ApiKey.name == name)).one_or_none()
