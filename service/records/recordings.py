"""Recordings: files as they came, stored once by SHA-256 before they are read, and read again on demand."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service import formats, parsing
from service.addresses import without_credentials
from service.buildings import store as building_store
from service.buildings.description import BuildingFile
from service.buildings.locking import locked
from service.buildings.tables import Building
from service.db.sessions import reading
from service.db.upsert import insert_into
from service.formats import Gain, Trace
from service.parsing import Limits
from service.records import originals
from service.records.originals import Secured
from service.records.sources.source import Known
from service.records.tables import FetchedFile, Recording
from service.settings import Settings

READ_STATIONS: dict[tuple[str, Limits], Mapping[str, Gain]] = {}
"""Gains of the StationXML files that this process has read, by the SHA-256 of their bytes."""
MOST_STATIONS = 256
"""Most station files whose contents a process caches. Not tuned."""


def store(session: Session, building: Building, name: str, origin: str, data: Secured, now: datetime) -> Recording:
    """Keep a file; one that the building already has is not kept again."""
    locked(session, building.id)  # one at a time, or two would both keep it
    had = select(Recording).where(Recording.building_id == building.id, Recording.sha256 == data.sha256)
    recording = session.scalar(had)
    originals.add(session, data)
    return recording or _recorded(session, building, name, origin, now, sha256=data.sha256, state="stored")


def refuse_unseen(
    session: Session, building: Building, name: str, origin: str, reason: str, now: datetime
) -> Recording:
    """Remember a file whose bytes were not fetched, and why."""
    had = select(Recording).where(
        Recording.building_id == building.id,
        Recording.sha256.is_(None),
        Recording.origin == storable(without_credentials(origin)),
        Recording.name == storable(name),
    )
    if (recording := session.scalar(had)) is not None:
        recording.reason = storable(reason)
        return recording
    return _recorded(session, building, name, origin, now, sha256=None, state="refused", reason=storable(reason))


def storable(text: str) -> str:
    """A text from outside in a form every database accepts: no NUL, and invalid Unicode written out."""
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
        reason=reason,
        failures=0,
    )
    session.add(recording)
    session.flush()
    return recording


def data_of(session: Session, recording: Recording, settings: Settings) -> bytes:
    """The bytes as they came.

    Raises:
        StoreAwayError, LostFileError: as of `originals.read`.
    """
    return originals.read(session, str(recording.sha256), settings.storage)


def traces_of(session: Session, recording: Recording, settings: Settings) -> tuple[Trace, ...]:
    """The building's traces in a recording that was read before."""
    units = units_of(session, session.get_one(Building, recording.building_id))
    data, known = data_of(session, recording, settings), gains_in(session, units, settings)
    contents = parsing.read(recording.name, data, known, parsing.limits(settings))
    return formats.of_building(contents.traces, units.described.description.channels)


@dataclass(frozen=True, slots=True)
class Units:
    """Sources of the units of a building's channels."""

    described: BuildingFile
    stations: tuple[str, ...]
    """SHA-256 of its StationXML files, the latest last."""


def units_of(session: Session, building: Building, described: BuildingFile | None = None) -> Units:
    """Sources of the units of a building's channels; its description is read if it is not given."""
    stations = (
        select(Recording.sha256)
        .where(Recording.building_id == building.id, Recording.kind == "station", Recording.state == "read")
        .order_by(Recording.id)
    )
    described = described or building_store.described(session, building)
    return Units(described, tuple(str(digest) for digest in session.scalars(stations)))


def gains(session: Session, building: Building, settings: Settings) -> Mapping[str, Gain]:
    """By channel id: from the building file, otherwise from the latest StationXML."""
    return gains_in(session, units_of(session, building), settings)


def gains_in(session: Session, units: Units, settings: Settings) -> Mapping[str, Gain]:
    """As `gains`; the session is used only for station files that this process has not read yet."""
    gains: dict[str, Gain] = {}
    for digest in units.stations:
        gains.update(_station_gains(session, digest, settings))
    return {**gains, **units.described.gains}


def _station_gains(session: Session, digest: str, settings: Settings) -> Mapping[str, Gain]:
    """The gains in a StationXML file; its bytes are fetched and read only once by a process."""
    limits = parsing.limits(settings)
    known = READ_STATIONS.get((digest, limits))
    if known is None:
        data = originals.read(session, digest, settings.storage)
        if len(READ_STATIONS) >= MOST_STATIONS:
            READ_STATIONS.clear()
        known = READ_STATIONS[digest, limits] = parsing.read("station", data, {}, limits).gains
    return known


@dataclass(frozen=True, slots=True)
class Fetched:
    """The files of one building's source that were fetched already."""

    sessions: sessionmaker[Session]
    building_id: int

    def known(self, addresses: Sequence[str]) -> Mapping[str, Known]:
        """The known files by address, without their beginnings."""
        stored = {storable(address): address for address in addresses}
        rows = select(FetchedFile).where(FetchedFile.building_id == self.building_id, FetchedFile.address.in_(stored))
        with reading(self.sessions)() as session:
            known = {stored[row.address]: row for row in session.scalars(rows)}
            return {address: Known(address, row.mark, row.attempts, row.version) for address, row in known.items()}

    def beginning(self, address: str) -> bytes:
        """The beginning of a body that broke off."""
        with reading(self.sessions)() as session:
            key = (self.building_id, storable(address))
            return session.get_one(FetchedFile, key, options=[undefer(FetchedFile.beginning)]).beginning or b""


def remember(session: Session, building: Building, files: Iterable[Known]) -> None:
    """Keep the present state of files of the building's source, with one statement."""
    states = {one.address: one for one in (replace(file, address=storable(file.address)) for file in files)}
    if not states:
        return
    new = insert_into(session, FetchedFile)
    keys = ("building_id", "address")
    kept = {column.key: column for column in new.excluded if column.key not in keys}
    rows = [{"building_id": building.id, **asdict(one)} for one in states.values()]
    session.execute(new.on_conflict_do_update(index_elements=keys, set_=kept), rows)
