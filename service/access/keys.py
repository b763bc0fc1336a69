"""API keys: creation, listing and revocation, and the keys and logins that are valid."""

from collections.abc import Collection, Mapping, Sequence
from datetime import datetime
from types import MappingProxyType

from sqlalchemy import ColumnElement, and_, or_, select, update
from sqlalchemy.orm import Session, joinedload

from service.access import logins
from service.access.roles import Role, digest, new_secret, soon_in_words
from service.access.tables import ApiKey, BuildingLink, LoginSession
from service.buildings.tables import Building
from service.errors import ConflictError, NotFoundError

NOTHING: Mapping[str, Role] = MappingProxyType({})


PERSON = "person:"
RESERVED = (PERSON, "link:")
"""Beginnings of the names of other callers in the audit trail."""


class KeyNameError(ConflictError):
    """The name of a key is in use or unknown, or the key would be of no use."""


def create(
    session: Session,
    name: str,
    role: Role,
    now: datetime,
    *,
    buildings: Collection[str] | None = None,
    higher: Mapping[str, Role] = NOTHING,
    expires_at: datetime | None = None,
) -> str:
    """A new key; it is not stored and cannot be shown again.

    Args:
        session: to write with.
        name: of the key.
        role: of the key.
        now: the time.
        buildings: codes of the buildings that exist for the key; None for all.
        higher: higher roles on single buildings, which exist for the key too.
        expires_at: when the key ends; None: only when it is revoked.

    Raises:
        KeyNameError: the name is in use, or was that of a revoked key: names are never used again; or a building is
            unknown, a role on a single building is not higher, or the end is not in the future.
    """
    if name.startswith(RESERVED):
        raise KeyNameError(
            f"The name of a key does not begin with {' or '.join(RESERVED)}, as those of other callers do."
        )
    if _find(session, name) is not None:
        raise KeyNameError(f"There is a key {name!r} already; choose another name.")
    if expires_at is not None and expires_at <= now:
        raise KeyNameError(f"The key would end at {expires_at:%Y-%m-%d %H:%M} UTC, which has passed.")
    for code, own in higher.items():
        if own <= role:
            raise KeyNameError(
                f"The role {own.name} on {code} is not higher than the key's role {role.name}; leave it out."
            )
    codes = None if buildings is None else sorted({*buildings, *higher})
    _check_codes(session, {*(codes or ()), *higher})
    key = new_secret("mk")
    single = {code: own.name for code, own in higher.items()} or None
    of_key = {"name": name, "role": role.name, "buildings": codes, "higher": single, "hash": digest(key)}
    session.add(ApiKey(**of_key, created_at=now, expires_at=expires_at))
    return key


def read_role(text: str) -> tuple[str, Role]:
    """A building's code and a role from `CODE=ROLE`.

    Raises:
        KeyNameError: it is not of that form.
    """
    code, _, role = text.partition("=")
    if not code or role not in Role.__members__:
        raise KeyNameError(f"{text!r} is not a building and a role, such as TWR=engineer.")
    return code, Role[role]


def roles_in_words(key: ApiKey) -> str:
    """The roles of a key, such as `viewer, engineer of TWR`."""
    return ", ".join((key.role, *(f"{role} of {code}" for code, role in sorted((key.higher or {}).items()))))


def _check_codes(session: Session, codes: Collection[str]) -> None:
    """Refuse unknown buildings, which would never be found."""
    known = set(session.scalars(select(Building.code).where(Building.code.in_(codes))))
    if unknown := sorted(set(codes) - known):
        raise KeyNameError(f"There is no building {unknown[0]!r}; 'menshin building list' shows their codes.")


def key(session: Session, key_id: int) -> ApiKey:
    """A key by its number.

    Raises:
        NotFoundError: there is none.
    """
    row = session.get(ApiKey, key_id)
    if row is None:
        raise NotFoundError("key", key_id)
    return row


def limit(
    session: Session, key: ApiKey, now: datetime, buildings: Collection[str] | None, expires_at: datetime | None
) -> None:
    """Limit a key to some of its buildings, or give it an earlier end; it never gets more than it had.

    Args:
        session: to write with.
        key: neither revoked nor expired.
        now: the time.
        buildings: codes of the buildings that remain; None for those that it has.
        expires_at: its new end; None for the one that it has.

    Raises:
        KeyNameError: the key has ended, or would get more.
    """
    if is_over(key, now):
        raise KeyNameError(f"The key {key.name!r} has ended; make a new one.")
    if buildings is not None:
        _check_codes(session, buildings)
        if more := set(buildings) - set(buildings if key.buildings is None else key.buildings):
            raise KeyNameError(f"{min(more)} does not exist for the key {key.name!r}; make a new key for it.")
        key.buildings = sorted(set(buildings))
        key.higher = {code: role for code, role in (key.higher or {}).items() if code in buildings} or None
    if expires_at is not None:
        if key.expires_at is not None and expires_at > key.expires_at:
            raise KeyNameError(f"The key {key.name!r} ends at {time_in_words(key.expires_at)} UTC; make a new one.")
        key.expires_at = expires_at


def is_over(key: ApiKey, now: datetime) -> bool:
    """True if a key was revoked or has expired."""
    return key.revoked_at is not None or (key.expires_at is not None and key.expires_at <= now)


def every(session: Session) -> Sequence[ApiKey]:
    """All keys, revoked ones too, by name."""
    return session.scalars(select(ApiKey).order_by(ApiKey.name)).all()


def end_in_words(key: ApiKey | BuildingLink, now: datetime) -> str:
    """The end of a key or link, past or future; one that is near is marked."""
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
    end(session, named(session, name), now)


def end(session: Session, key: ApiKey, now: datetime) -> None:
    """Revoke a key and end its browser sessions; revoking it again changes nothing."""
    key.revoked_at = key.revoked_at or now
    logins.end_all(session, key.id, now)


def log_out(session: Session, name: str | None, now: datetime) -> int:
    """End all browser sessions, or those of one key or person; the number of valid ones that were ended.

    Raises:
        KeyNameError: no key has that name.
    """
    if name is None:
        return logins.end_all(session, None, now)
    if name.startswith(PERSON):
        return logins.end_person(session, name, now)
    return logins.end_all(session, named(session, name).id, now)


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
    """Valid browser sessions with their keys: not ended, idle or expired, and without a key that is not valid."""
    query = select(LoginSession).outerjoin(LoginSession.key).options(joinedload(LoginSession.key))
    living = (
        LoginSession.ended_at.is_(None),
        LoginSession.used_at > used_after,
        LoginSession.created_at > created_after,
        or_(LoginSession.key_id.is_(None), and_(*is_valid(now))),
        or_(LoginSession.expires_at.is_(None), LoginSession.expires_at > now),
    )
    return session.scalars(query.where(*living)).all()


def named(session: Session, name: str) -> ApiKey:
    """A key by its name.

    Raises:
        KeyNameError: no key has that name.
    """
    row = _find(session, name)
    if row is None:
        raise KeyNameError(f"There is no key {name!r}; 'menshin key list' shows them.")
    return row


def _find(session: Session, name: str) -> ApiKey | None:
    return session.scalars(select(ApiKey).where(ApiKey.name == name)).one_or_none()
