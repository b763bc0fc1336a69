"""Buildings under watch: added and described anew, every description kept."""

from datetime import datetime
from functools import lru_cache
from pathlib import Path

from sqlalchemy import select, update
from sqlalchemy.orm import Session

from service.buildings import description, recipients
from service.buildings.description import BuildingFile
from service.buildings.tables import Building, Revision
from service.records.tables import Recording


class BuildingError(Exception):
    """A building that is there already, or is not; the message says which ones are."""


def add(session: Session, text: str, folder: Path, now: datetime) -> Building:
    """Take a building under watch.

    Args:
        session: of the transaction.
        text: its building file.
        folder: where the file lies; a relative source location starts here.
        now: aware time.

    Raises:
        BuildingError: its code is taken.
        BuildingFileError: the file is wrong.
    """
    described = description.read_new(text, folder).description
    if session.scalar(select(Building).where(Building.code == described.code)) is not None:
        raise BuildingError(f"building {described.code!r} is there already; `menshin building update` would do")
    building = Building(code=described.code, name=described.name, created_at=now)
    session.add(building)
    _describe(session, building, 1, text, folder, now)
    return building


def update_description(session: Session, text: str, folder: Path, now: datetime) -> Revision:
    """Describe a building anew: later results name the new revision, and what was refused is read again.

    That it is read again holds for a description that says nothing new, too.

    Returns:
        The revision in force; the one before, if nothing changed.

    Raises:
        BuildingError: there is no building of that code.
        BuildingFileError: the file is wrong.
    """
    described = description.read_new(text, folder).description
    building = find(session, described.code)
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
    """The building's description in force."""
    newest = select(Revision).where(Revision.building_id == building.id).order_by(Revision.number.desc()).limit(1)
    return session.scalars(newest).one()


def described(session: Session, building: Building) -> BuildingFile:
    """What the building's description in force says."""
    revision = current(session, building)
    return _read(revision.toml, revision.folder)


def read_again(session: Session, building: Building) -> None:
    """Let recordings that were refused, or of which channels were left out, be read again with the next file."""
    wanting = (Recording.building_id == building.id, Recording.sha256.is_not(None), Recording.reason.is_not(None))
    session.execute(update(Recording).where(*wanting).values(state="stored", failures=0))


def _describe(session: Session, building: Building, number: int, text: str, folder: Path, now: datetime) -> Revision:
    revision = Revision(building=building, number=number, toml=text, folder=str(folder), created_at=now)
    session.add(revision)
    session.flush()
    recipients.follow_file(session, building.id, _read(toml=text, folder=str(folder)).receivers, now)
    return revision


@lru_cache(maxsize=256)
def _read(toml: str, folder: str) -> BuildingFile:
    return description.read(toml, Path(folder))
