"""Buildings: added, described anew, and read; every description is kept."""

from contextlib import suppress
from datetime import datetime
from functools import lru_cache
from pathlib import Path

from pydantic import ValidationError
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.buildings import description, recipients
from service.buildings.description import BuildingFile
from service.buildings.locking import locked
from service.buildings.tables import Building, Revision
from service.records.tables import Content, Recording


class BuildingError(Exception):
    """A building that exists already, or does not; the message lists the existing ones."""


def add(session: Session, text: str, folder: Path, now: datetime) -> Building:
    """Add a building.

    Args:
        session: of the transaction.
        text: its building file.
        folder: where the file lies; a relative source location starts here.
        now: aware time.

    Raises:
        BuildingError: its code is in use.
        BuildingFileError: the file is wrong.
    """
    described = description.read_new(text, folder).description
    if session.scalar(select(Building).where(Building.code == described.code)) is not None:
        raise BuildingError(f"building {described.code!r} exists already; use `menshin building update`")
    building = Building(code=described.code, name=described.name, created_at=now)
    session.add(building)
    _describe(session, building, 1, text, folder, now)
    return building


def update_description(session: Session, text: str, folder: Path, now: datetime) -> Revision:
    """Describe a building anew: later results name the new revision, and rejected recordings are read again.

    They are read again even if the description does not change.

    Returns:
        The current revision; the one before, if nothing changed.

    Raises:
        BuildingError: there is no building of that code.
        BuildingFileError: the file is wrong.
    """
    described = description.read_new(text, folder).description
    building = locked(session, find(session, described.code).id)
    before = current(session, building)
    read_again(session, building)
    if (before.toml, before.folder) == (text, str(folder)):
        return before
    building.name = described.name
    return _describe(session, building, before.number + 1, text, folder, now)


def find(session: Session, code: str) -> Building:
    """The building of a code.

    Raises:
        BuildingError: there is none.
    """
    building = session.scalar(select(Building).where(Building.code == code))
    if building is None:
        known = ", ".join(session.scalars(select(Building.code).order_by(Building.code))) or "none yet"
        raise BuildingError(f"no building {code!r}; there are: {known}")
    return building


def current(session: Session, building: Building) -> Revision:
    """The building's current revision."""
    newest = select(Revision).where(Revision.building_id == building.id).order_by(Revision.number.desc()).limit(1)
    return session.scalars(newest).one()


def described(session: Session, building: Building) -> BuildingFile:
    """The building's current description."""
    return parsed(current(session, building))


def zone(session: Session, building: Building) -> str:
    """The building's time zone, an IANA name."""
    return described(session, building).timezone


def parsed(revision: Revision) -> BuildingFile:
    """The description in a revision."""
    return _parsed(revision.parsed, revision.toml, revision.folder)


def read_again(session: Session, building: Building) -> None:
    """Read recordings again, with the next file, that were rejected or lacked channels."""
    is_there = Recording.content.has(Content.deleted_at.is_(None))
    wanting = (Recording.building_id == building.id, is_there, Recording.reason.is_not(None))
    session.execute(update(Recording).where(*wanting).values(state="stored", failures=0))


def _describe(session: Session, building: Building, number: int, text: str, folder: Path, now: datetime) -> Revision:
    revision = Revision(building=building, number=number, toml=text, folder=str(folder), created_at=now)
    revision.parsed = description.stored(text)
    file = parsed(revision)
    building.latitude, building.longitude = file.latitude, file.longitude
    session.add(revision)
    session.flush()
    recipients.follow_file(session, building.id, file.receivers, now)
    return revision


@lru_cache(maxsize=256)
def _parsed(stored: str | None, toml: str, folder: str) -> BuildingFile:
    """From the stored tables; from the file where there are none, or where they are of a version with other keys."""
    if stored is not None:
        with suppress(ValidationError):
            return description.restored(stored, Path(folder))
    return description.read(toml, Path(folder))
