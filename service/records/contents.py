"""What is in the bytes of recordings that are kept: read again whenever it is asked for."""

from collections.abc import Mapping
from functools import lru_cache

from sqlalchemy import select
from sqlalchemy.orm import Session, undefer

from service import formats, parsing
from service.buildings import store as building_store
from service.buildings.tables import Building
from service.formats import Gain, Trace
from service.parsing import Limits
from service.records.tables import Content, Recording


def data_of(session: Session, recording: Recording) -> bytes:
    """The bytes as they came."""
    content = select(Content).where(Content.sha256 == recording.sha256).options(undefer(Content.data))
    return session.scalars(content).one().data


def traces_of(session: Session, recording: Recording, limits: Limits) -> tuple[Trace, ...]:
    """The building's traces in a recording that was read before."""
    building = session.get_one(Building, recording.building_id)
    described = building_store.described(session, building)
    contents = parsing.read(recording.name, data_of(session, recording), gains(session, building, limits), limits)
    return formats.of_building(contents.traces, described.description.channels)


def gains(session: Session, building: Building, limits: Limits) -> Mapping[str, Gain]:
    """By channel id: the building file's, else the latest StationXML's."""
    stations = (
        select(Content.data)
        .join(Recording, Recording.sha256 == Content.sha256)
        .where(Recording.building_id == building.id, Recording.kind == "station", Recording.state == "read")
        .order_by(Recording.id)
    )
    found: dict[str, Gain] = {}
    for data in session.scalars(stations):
        found.update(_station_gains(data, limits))
    return {**found, **building_store.described(session, building).gains}


@lru_cache(maxsize=64)
def _station_gains(data: bytes, limits: Limits) -> Mapping[str, Gain]:
    found: Mapping[str, Gain] = parsing.read("station", data, {}, limits).gains
    return found
