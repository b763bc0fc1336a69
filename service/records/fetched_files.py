"""Which files of a building's source were taken, kept in the database."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass

from sqlalchemy import select
from sqlalchemy.orm import Session, sessionmaker, undefer

from service.buildings.tables import Building
from service.db.sessions import reading
from service.records.recordings import storable
from service.records.sources.memory import Known
from service.records.tables import FetchedFile


@dataclass(frozen=True, slots=True)
class Fetched:
    """What is known of the files of one building's source."""

    sessions: sessionmaker[Session]
    building_id: int

    def known(self, addresses: Sequence[str]) -> Mapping[str, Known]:
        """By address, those that anything is known of; without their beginnings."""
        stored = {storable(address): address for address in addresses}
        rows = select(FetchedFile).where(FetchedFile.building_id == self.building_id, FetchedFile.address.in_(stored))
        with reading(self.sessions)() as session:
            known = {stored[row.address]: row for row in session.scalars(rows)}
            return {address: Known(address, row.mark, row.attempts, row.version) for address, row in known.items()}

    def beginning(self, address: str) -> bytes:
        """Of a body that broke off."""
        with reading(self.sessions)() as session:
            key = (self.building_id, storable(address))
            return session.get_one(FetchedFile, key, options=[undefer(FetchedFile.beginning)]).beginning or b""


def remember(session: Session, building: Building, files: Iterable[Known]) -> None:
    """Keep what is known of files now."""
    for file in files:
        columns = asdict(file) | {"address": storable(file.address)}
        session.merge(FetchedFile(building_id=building.id, **columns))
