"""The level of every building, stored when its facts change, so that ten thousand can be sorted and counted.

To sort by level, a page of fifty buildings would have to assess all of them. The stored level decides the order and the
counts only. The verdict that people read is assessed as they read it.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import ColumnElement, func, or_, select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from service.buildings.tables import Building
from service.db.select import Line, Question
from service.verdict import reading
from service.verdict.checks import LEVELS, Level
from service.verdict.tables import BuildingLevel

TOGETHER = 200
"""Buildings that are assessed by one set of statements. Not tuned."""


def _rank() -> ColumnElement[int]:
    """Rank of a building's level; one that was never assessed counts as undecided."""
    return func.coalesce(BuildingLevel.rank, Level.UNDECIDED.rank)


@dataclass(frozen=True, slots=True)
class Area:
    """A part of the map, degrees; west may be greater than east, across the date line."""

    south: float
    west: float
    north: float
    east: float


@dataclass(frozen=True, slots=True)
class Selection:
    """The buildings of a list."""

    level: Level | None = None
    text: str = ""
    """Part of the code or the name, whatever its case; empty: any."""
    area: Area | None = None

    def conditions(self) -> Sequence[ColumnElement[bool]]:
        """Conditions on Building and BuildingLevel."""
        found: list[ColumnElement[bool]] = []
        if self.level is not None:
            found.append(_rank() == self.level.rank)
        if self.text:
            part = self.text.lower()
            named = (func.lower(column).contains(part, autoescape=True) for column in (Building.code, Building.name))
            found.append(or_(*named))
        if self.area is not None:
            found += _within(self.area)
        return found


def store(session: Session, buildings: Collection[int], now: datetime) -> None:
    """Assess these buildings, by number, and store their levels; the last to write is right."""
    numbers = sorted(buildings)
    for first in range(0, len(numbers), TOGETHER):
        some = select(Building.id).where(Building.id.in_(numbers[first : first + TOGETHER]))
        rows = [
            {
                "building_id": one.building.id,
                "level": one.verdict.level.value,
                "rank": one.verdict.level.rank,
                "latitude": one.file.latitude,
                "longitude": one.file.longitude,
                "assessed_at": now,
            }
            for one in reading.standings(session, some)
        ]
        if rows:
            _upsert(session, rows)


def ranked(session: Session, wanted: Selection, offset: int, limit: int) -> Sequence[int]:
    """Numbers of buildings, the worst level first, then by code."""
    query = _joined(select(Building.id), wanted).order_by(_rank().desc(), Building.code)
    return session.scalars(query.offset(offset).limit(limit)).all()


def counts(session: Session, wanted: Selection) -> Mapping[int, int]:
    """Number of buildings by rank."""
    query = _joined(select(_rank().label("rank"), func.count()), wanted).group_by("rank")
    return {row[0]: row[1] for row in session.execute(query)}


def ranks_by_code(session: Session) -> Mapping[str, int]:
    """Rank of every building by its code: as stored, or as assessed now where none has been stored yet."""
    query = select(Building.id, Building.code, BuildingLevel.rank).select_from(Building)
    lines = session.execute(query.outerjoin(BuildingLevel, BuildingLevel.building_id == Building.id)).all()
    new = [number for number, _, rank in lines if rank is None]
    some = select(Building.id).where(Building.id.in_(new[:TOGETHER]))
    assessed = reading.of_buildings(session, some) if new else {}
    undecided = Level.UNDECIDED.rank
    return {
        code: rank if rank is not None else assessed[number].level.rank if number in assessed else undecided
        for number, code, rank in lines
    }


def stored_ranks(session: Session, buildings: Collection[int]) -> Mapping[int, int]:
    """Rank by number of the building, as `ranked` sorts by it."""
    query = _joined(select(Building.id, _rank()), Selection()).where(Building.id.in_(buildings))
    return {row[0]: row[1] for row in session.execute(query)}


def places(session: Session, wanted: Selection) -> Sequence[Line]:
    """(code, name, rank, latitude, longitude) of the buildings with coordinates, the worst level first."""
    columns = (Building.code, Building.name, _rank(), BuildingLevel.latitude, BuildingLevel.longitude)
    query = _joined(select(*columns), wanted).where(
        BuildingLevel.latitude.is_not(None), BuildingLevel.longitude.is_not(None)
    )
    return session.execute(query.order_by(_rank().desc(), Building.code)).all()


def of_rank(rank: int) -> Level:
    """The level of a rank."""
    return LEVELS[len(LEVELS) - 1 - rank]


def _joined(query: Question, wanted: Selection) -> Question:
    joined = query.select_from(Building).outerjoin(BuildingLevel, BuildingLevel.building_id == Building.id)
    return joined.where(*wanted.conditions())


def _within(area: Area) -> Sequence[ColumnElement[bool]]:
    after, until = BuildingLevel.longitude >= area.west, BuildingLevel.longitude <= area.east
    return (
        BuildingLevel.latitude.between(area.south, area.north),
        (after & until) if area.west <= area.east else (after | until),
    )


def _upsert(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    dialect: Any = postgresql if session.get_bind().dialect.name == "postgresql" else sqlite
    insert = dialect.insert(BuildingLevel).values(rows)
    changed = {name: insert.excluded[name] for name in rows[0] if name != "building_id"}
    session.execute(insert.on_conflict_do_update(index_elements=["building_id"], set_=changed))
