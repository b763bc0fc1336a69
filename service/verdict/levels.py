"""The level of every building, stored when its facts change, so that ten thousand can be sorted and counted.

To sort by level, a page of fifty buildings would have to assess all of them. The stored level decides the order and the
counts only. The verdict that people read is assessed as they read it.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import reduce
from typing import Any

from sqlalchemy import ColumnElement, Text, and_, case, cast, func, or_, select, true
from sqlalchemy.orm import Session

from service.buildings.tables import Building
from service.db.select import Question
from service.db.upsert import insert_into
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
class Extent:
    """Where some buildings are, degrees."""

    count: int
    south: float
    north: float
    west: float
    """The least longitude."""
    east: float
    """The greatest longitude."""
    last_western: float | None
    """The greatest negative longitude."""
    first_eastern: float | None
    """The least longitude that is not negative."""

    def joined(self, other: "Extent") -> "Extent":
        """The extent of these buildings and others."""
        western = [one for one in (self.last_western, other.last_western) if one is not None]
        eastern = [one for one in (self.first_eastern, other.first_eastern) if one is not None]
        return Extent(
            count=self.count + other.count,
            south=min(self.south, other.south),
            north=max(self.north, other.north),
            west=min(self.west, other.west),
            east=max(self.east, other.east),
            last_western=max(western, default=None),
            first_eastern=min(eastern, default=None),
        )

    @property
    def degrees(self) -> tuple[float, float]:
        """Longitude from which all others are counted eastwards, so that no group is torn at the date line; width."""
        if self.east - self.west <= 180 or self.first_eastern is None or self.last_western is None:
            return self.west, self.east - self.west
        return self.first_eastern, self.last_western + 360 - self.first_eastern


@dataclass(frozen=True, slots=True)
class Tally:
    """Numbers of buildings by level, and where they are."""

    every: Counter[Level]
    found: Counter[Level]
    """Numbers of buildings by wanted level."""
    extent: Extent | None
    """Extent of the wanted buildings that have coordinates; None if none has."""


@dataclass(frozen=True, slots=True)
class Grid:
    """Cells of a map, degrees; longitudes are counted eastwards from `shift`."""

    shift: float
    west: float
    south: float
    """Edges of the cell with column 0 and row 0."""
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Spot:
    """The buildings in a cell of a map; `east`, `first` and `last` are degrees east of the grid's `shift`."""

    column: int
    row: int
    count: int
    level: Level
    """The worst of its buildings."""
    code: str
    name: str
    """Name of the first building of that level, by code."""
    north: float
    east: float
    """Mean latitude and longitude."""
    least: float
    most: float
    """Bounds of the latitudes."""
    first: float
    last: float
    """Bounds of the longitudes."""


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
        rows = [
            {
                "building_id": one.building.id,
                "level": one.verdict.level.value,
                "rank": one.verdict.level.rank,
                "latitude": one.file.latitude,
                "longitude": one.file.longitude,
                "assessed_at": now,
            }
            for one in reading.standings(session, numbers[first : first + TOGETHER])
        ]
        if rows:
            _upsert(session, sorted(rows, key=lambda row: row["building_id"]))  # two at once lock them in one order


def ranked(session: Session, wanted: Selection, offset: int, limit: int) -> Sequence[int]:
    """Numbers of buildings, the worst level first, then by code."""
    query = _joined(select(Building.id)).where(*wanted.conditions()).order_by(_rank().desc(), Building.code)
    return session.scalars(query.offset(offset).limit(limit)).all()


def tally(session: Session, wanted: Selection, without: Collection[int]) -> Tally:
    """Number of buildings by level, and the extent of the wanted ones, by one statement that reads each row once.

    Args:
        session: of the database.
        wanted: buildings that are counted by themselves, too.
        without: numbers of buildings that are left out.
    """
    latitude, longitude = BuildingLevel.latitude, BuildingLevel.longitude
    edges = (func.min(latitude), func.max(latitude), func.min(longitude), func.max(longitude))
    western, eastern = func.max(case((longitude < 0, longitude))), func.min(case((longitude >= 0, longitude)))
    is_wanted = and_(true(), *wanted.conditions()).label("is_wanted")
    is_placed = and_(latitude.is_not(None), longitude.is_not(None)).label("is_placed")
    keys = (_rank().label("stored_rank"), is_wanted, is_placed)
    query = _joined(select(*keys, func.count(), *edges, western, eastern)).where(Building.id.not_in(without))
    every, found, extents = Counter[Level](), Counter[Level](), []
    for rank, chosen, has_place, count, *bounds in session.execute(query.group_by(*(one.name for one in keys))):
        every[of_rank(rank)] += count
        if chosen:
            found[of_rank(rank)] += count
        if chosen and has_place:
            extents.append(Extent(count, *bounds))
    return Tally(every, found, reduce(Extent.joined, extents) if extents else None)


def ranks_by_code(session: Session) -> Mapping[str, int]:
    """Rank of every building by its code: as stored, or as assessed now where none has been stored yet."""
    every = session.execute(_joined(select(Building.id, Building.code, BuildingLevel.rank))).all()
    new = [number for number, _, rank in every if rank is None]
    assessed = reading.of_buildings(session, new[:TOGETHER]) if new else {}
    undecided = Level.UNDECIDED.rank
    return {
        code: rank if rank is not None else assessed[number].level.rank if number in assessed else undecided
        for number, code, rank in every
    }


def spots(session: Session, wanted: Selection, grid: Grid, without: Collection[int]) -> Sequence[Spot]:
    """The buildings with coordinates by cell of a grid, in one statement that returns a line for each cell.

    Args:
        session: of the database.
        wanted: the buildings.
        grid: the cells.
        without: numbers of buildings that are left out.
    """
    latitude, longitude = BuildingLevel.latitude, BuildingLevel.longitude
    east = case((longitude < grid.shift, longitude + 360.0), else_=longitude) - grid.shift
    # `floor` is missing in some builds of SQLite, and a cast to an integer rounds on PostgreSQL
    column = func.round((east - grid.west) / grid.width - 0.5).label("cell_column")
    row = func.round((latitude - grid.south) / grid.height - 0.5).label("cell_row")
    worst = func.min(cast(Level.ACT.rank - _rank(), Text) + Building.code + " " + Building.name)  # codes have no spaces
    means = (func.avg(latitude), func.avg(east))
    bounds = (func.min(latitude), func.max(latitude), func.min(east), func.max(east))
    has_place = (latitude.is_not(None), longitude.is_not(None), Building.id.not_in(without))
    query = _joined(select(column, row, func.count(), worst, *means, *bounds)).where(*has_place, *wanted.conditions())
    return [_spot(*line) for line in session.execute(query.group_by("cell_column", "cell_row"))]


def _spot(column: float, row: float, count: int, worst: str, *places: float) -> Spot:
    """A cell of a line; `worst` is the distance of the level from the gravest, a digit, then the code and the name."""
    code, _, name = worst[1:].partition(" ")
    return Spot(int(column), int(row), count, of_rank(Level.ACT.rank - int(worst[0])), code, name, *places)


def of_rank(rank: int) -> Level:
    """The level of a rank."""
    return LEVELS[len(LEVELS) - 1 - rank]


def _joined(query: Question) -> Question:
    return query.select_from(Building).outerjoin(BuildingLevel, BuildingLevel.building_id == Building.id)


def _within(area: Area) -> Sequence[ColumnElement[bool]]:
    after, until = BuildingLevel.longitude >= area.west, BuildingLevel.longitude <= area.east
    return (
        BuildingLevel.latitude.between(area.south, area.north),
        (after & until) if area.west <= area.east else (after | until),
    )


def _upsert(session: Session, rows: Sequence[Mapping[str, Any]]) -> None:
    insert = insert_into(session, BuildingLevel).values(rows)
    changed = {name: insert.excluded[name] for name in rows[0] if name != "building_id"}
    session.execute(insert.on_conflict_do_update(index_elements=["building_id"], set_=changed))
