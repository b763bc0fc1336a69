"""Files as they came: their bytes are stored once, by SHA-256, before anything is read from them."""

from datetime import datetime
from hashlib import sha256
from typing import Any

from sqlalchemy import select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from service.buildings.tables import Building
from service.records.tables import Content, Recording
from service.shown_addresses import without_credentials


def store(session: Session, building: Building, name: str, origin: str, data: bytes, now: datetime) -> Recording:
    """Keep a file; one that the building has already is not kept again."""
    session.get_one(Building, building.id, with_for_update=True)  # one at a time, or two would both keep it
    digest = sha256(data).hexdigest()
    had = select(Recording).where(Recording.building_id == building.id, Recording.sha256 == digest)
    if (recording := session.scalar(had)) is not None:
        return recording
    content = {"sha256": digest, "size": len(data), "data": data}
    session.execute(_insert(session, Content).values(content).on_conflict_do_nothing())
    return _recorded(session, building, name, origin, now, sha256=digest, state="stored")


def refuse_unseen(
    session: Session, building: Building, name: str, origin: str, reason: str, now: datetime
) -> Recording:
    """Remember a file whose bytes were not taken, and why."""
    had = select(Recording).where(
        Recording.building_id == building.id,
        Recording.sha256.is_(None),
        Recording.origin == storable(without_credentials(origin)),
        Recording.name == storable(name),
    )
    if (recording := session.scalar(had)) is not None:
        recording.reason = storable(reason)
        return recording
    return _recorded(session, building, name, origin, now, sha256=None, state="refused", reason=reason)


def storable(text: str) -> str:
    """A text from outside as every database takes it: without NUL, and with names that are no Unicode written out."""
    return text.encode("utf-8", "backslashreplace").decode().replace("\0", "\N{REPLACEMENT CHARACTER}")


def _recorded(
    session: Session,
    building: Building,
    name: str,
    origin: str,
    now: datetime,
    *,
    sha256: str | None,
    state: str,
    reason: str | None = None,
) -> Recording:
    recording = Recording(
        building_id=building.id,
        sha256=sha256,
        name=storable(name),
        origin=storable(without_credentials(origin)),
        received_at=now,
        kind="unknown",
        state=state,
        reason=None if reason is None else storable(reason),
        failures=0,
    )
    session.add(recording)
    session.flush()
    return recording


def _insert(session: Session, table: type[Any]) -> Any:  # noqa: ANN401  the dialects share no type for it
    dialect = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
    return dialect.insert(table)
