"""A map of the buildings without tiles: symbols by level on a graticule with a scale bar, as coordinates of an SVG.

The projection is equirectangular, true to scale at the middle latitude: good for a city or a country, and honest about
being no chart of the world. Buildings that would lie on each other share the symbol of the worst, which leads nearer.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil, cos, floor, log10, radians

from sqlalchemy.orm import Session

from service.buildings.pages.summary import Summary
from service.verdict import levels
from service.verdict.checks import Level
from service.verdict.levels import Area, Extent, Grid, Selection, Spot

WIDTH, LOWEST, HIGHEST, MARGIN = 640.0, 280.0, 520.0, 40.0
"""Units of the drawing: its width, the limits of its height, and the edge that symbols stay clear of."""
CELL = 34.0
"""Symbols nearer than this are drawn as one."""
SMALLEST = 0.02
"""° of latitude that a map shows at least, 2.2 km."""
KILOMETRES = 111.2
"""Length of a degree of latitude."""
APART = 160.0
"""Units between two lines of the graticule, at most."""
EDGE = 24.0
"""Units from the edge within which a line would cover the names of the others."""
NAMED = 16
"""Symbols up to which each has its name beside it."""
LINES = r"^(-?[0-9]{1,3}(\.[0-9]{1,6})?,){3}-?[0-9]{1,3}(\.[0-9]{1,6})?$"
"""An area in an address: south, west, north, east."""


@dataclass(frozen=True, slots=True)
class Place:
    """One symbol."""

    x: float
    y: float
    level: Level
    """The worst of its buildings."""
    count: int
    name: str
    """Name of the building with the worst level."""
    code: str
    area: str
    """Bounds of its buildings, as a parameter of an address."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the graticule: its place in units of the drawing, and its name, such as `35.5° N`."""

    at: float
    name: str


@dataclass(frozen=True, slots=True)
class Map:
    """A map, ready to be drawn."""

    height: float
    places: Sequence[Place]
    meridians: Sequence[Line]
    parallels: Sequence[Line]
    bar: float
    """Length of the scale bar in units of the drawing."""
    bar_name: str
    is_named: bool
    """True if there is room for names."""


def read_area(text: str) -> Area:
    """The area of an address that matches LINES."""
    return Area(*(float(part) for part in text.split(",")))


def drawn(session: Session, wanted: Selection, extent: Extent | None, lines: Sequence[Summary]) -> Map | None:
    """The map of the wanted buildings; None for fewer than two.

    The database gathers them by cell of the map, so that ten thousand are read as a few hundred.

    Args:
        session: of the database.
        wanted: the buildings.
        extent: of those that the page does not list; None if there is none.
        lines: those that the page lists, of which newer levels are known than the database has.
    """
    listed, newer = [one.number for one in lines], list(_points(lines))
    if newer:
        extent = _extent(newer) if extent is None else extent.joined(_extent(newer))
    if extent is None or extent.count < 2:
        return None
    frame = Frame.of(extent)
    spots = {(one.column, one.row): one for one in levels.spots(session, wanted, frame.grid, listed)}
    for point in newer:
        spot = frame.spot(point)
        cell = (spot.column, spot.row)
        spots[cell] = _joined(spots[cell], spot) if cell in spots else spot
    return _drawn(frame, list(spots.values()))


@dataclass(frozen=True, slots=True)
class Point:
    """A building that the page lists."""

    code: str
    name: str
    level: Level
    latitude: float
    longitude: float


@dataclass(frozen=True, slots=True)
class Frame:
    """A map's projection: `middle` is its latitude, `centre` its longitude in degrees east of `shift`."""

    shift: float
    centre: float
    middle: float
    shrink: float
    """Length of a degree of longitude in degrees of latitude."""
    scale: float
    """Units of a degree of latitude."""
    height: float

    @classmethod
    def of(cls, extent: Extent) -> "Frame":
        """The projection that shows all of it."""
        shift, degrees = extent.degrees
        middle = (extent.south + extent.north) / 2
        shrink = max(cos(radians(middle)), 0.05)
        tall, wide = max(extent.north - extent.south, SMALLEST), max(degrees * shrink, SMALLEST)
        scale = min((WIDTH - 2 * MARGIN) / wide, (HIGHEST - 2 * MARGIN) / tall)
        return cls(
            shift=shift,
            centre=degrees / 2,
            middle=middle,
            shrink=shrink,
            scale=scale,
            height=min(max(tall * scale + 2 * MARGIN, LOWEST), HIGHEST),
        )

    def x(self, east: float) -> float:
        """Units from the left, of degrees east of `shift`."""
        return WIDTH / 2 + (east - self.centre) * self.shrink * self.scale

    def y(self, north: float) -> float:
        """Units from the top, of a latitude."""
        return self.height / 2 - (north - self.middle) * self.scale

    @property
    def grid(self) -> Grid:
        """The cells whose buildings share a symbol."""
        unit = self.shrink * self.scale
        west, south = self.centre - WIDTH / 2 / unit, self.middle - self.height / 2 / self.scale
        return Grid(self.shift, west, south, CELL / unit, CELL / self.scale)

    def spot(self, point: Point) -> Spot:
        """A building alone in its cell."""
        grid, north, east = self.grid, point.latitude, (point.longitude - self.shift) % 360
        column, row = floor((east - grid.west) / grid.width), floor((north - grid.south) / grid.height)
        return Spot(column, row, 1, point.level, point.code, point.name, north, east, north, north, east, east)


def _points(lines: Sequence[Summary]) -> Iterator[Point]:
    for one in lines:
        if one.latitude is not None and one.longitude is not None:
            yield Point(one.code, one.name, one.level, one.latitude, one.longitude)


def _extent(points: Sequence[Point]) -> Extent:
    latitudes, longitudes = [one.latitude for one in points], [one.longitude for one in points]
    return Extent(
        count=len(points),
        south=min(latitudes),
        north=max(latitudes),
        west=min(longitudes),
        east=max(longitudes),
        last_western=max((one for one in longitudes if one < 0), default=None),
        first_eastern=min((one for one in longitudes if one >= 0), default=None),
    )


def _joined(one: Spot, other: Spot) -> Spot:
    """The buildings of both, in one cell."""
    count = one.count + other.count
    worst = min(one, other, key=lambda spot: (-spot.level.rank, spot.code))
    return replace(
        worst,
        count=count,
        north=(one.count * one.north + other.count * other.north) / count,
        east=(one.count * one.east + other.count * other.east) / count,
        least=min(one.least, other.least),
        most=max(one.most, other.most),
        first=min(one.first, other.first),
        last=max(one.last, other.last),
    )


def _drawn(frame: Frame, spots: Sequence[Spot]) -> Map:
    places = [
        Place(
            x=round(frame.x(spot.east), 1),
            y=round(frame.y(spot.north), 1),
            level=spot.level,
            count=spot.count,
            name=spot.name,
            code=spot.code,
            area=_area(spot, frame.shift),
        )
        for spot in spots
    ]
    scale, wide = frame.scale, frame.shrink * frame.scale
    bar = _nice(0.3 * WIDTH / scale * KILOMETRES)
    half, tall = (WIDTH / 2 - EDGE) / wide, (frame.height / 2 - EDGE) / scale
    return Map(
        height=round(frame.height),
        places=sorted(places, key=lambda one: (one.level.rank, one.code)),  # the worst is drawn last, above the others
        meridians=list(_lines(frame.centre, half, _nice(APART / wide), frame.x, frame.shift, "EW")),
        parallels=list(_lines(frame.middle, tall, _nice(APART / scale), frame.y, 0.0, "NS")),
        bar=round(bar / KILOMETRES * scale, 1),
        bar_name=f"{bar:g} km" if bar >= 1 else f"{1000 * bar:g} m",
        is_named=len(places) <= NAMED,
    )


def _area(spot: Spot, shift: float) -> str:
    """South, west, north and east of the buildings, a little enlarged."""
    edge = 0.0005
    west, east = ((one + shift + 180) % 360 - 180 for one in (spot.first - edge, spot.last + edge))
    south, north = max(spot.least - edge, -90.0), min(spot.most + edge, 90.0)
    return ",".join(f"{value:.4f}" for value in (south, west, north, east))


def _nice(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above `most`."""
    power = 10.0 ** floor(log10(most))
    return max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= most * (1 + 1e-9))


def _lines(
    middle: float, half: float, step: float, place: Callable[[float], float], shift: float, signs: str
) -> Iterator[Line]:
    """Lines at the multiples of `step` within `half` of the middle; `signs` name the positive and the negative side."""
    first, last = ceil((middle - half + shift) / step), floor((middle + half + shift) / step)
    for number in range(first, last + 1):
        degrees = number * step
        shown = (degrees + 180) % 360 - 180 if signs == "EW" else degrees
        sign = "" if shown == 0 else f" {signs[0] if shown > 0 else signs[1]}"
        yield Line(at=round(place(degrees - shift), 1), name=f"{round(abs(shown), 6):g}°{sign}")
