"""A map of the buildings without tiles: symbols by level on a graticule with a scale bar, as coordinates of an SVG.

The projection is equirectangular, true to scale at the middle latitude: good for a city or a country, and honest about
being no chart of the world. Buildings that would lie on each other share the symbol of the worst.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, cos, floor, log10, radians
from typing import Any

from service.buildings.pages.summary import Summary
from service.verdict.checks import Level
from service.verdict.levels import Area, of_rank

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


def drawn(stored: Sequence[Any], lines: Sequence[Summary]) -> Map | None:
    """The map of the stored places and of the listed buildings, which are newer; None for fewer than two.

    Args:
        stored: lines of service.verdict.levels.places.
        lines: buildings that the page lists.
    """
    points = {code: (name, of_rank(rank), lat, lon) for code, name, rank, lat, lon in stored}
    for one in lines:
        if one.latitude is not None and one.longitude is not None:
            points[one.code] = (one.name, one.level, one.latitude, one.longitude)
    if len(points) < 2:
        return None
    return _drawn([(code, *point) for code, point in points.items()])


def _drawn(points: Sequence[tuple[str, str, Level, float, float]]) -> Map:
    shift = _shift([point[4] for point in points])
    east = [(point[4] - shift) % 360 for point in points]
    north = [point[3] for point in points]
    middle = (min(north) + max(north)) / 2
    shrink = max(cos(radians(middle)), 0.05)
    tall = max(max(north) - min(north), SMALLEST)
    wide = max((max(east) - min(east)) * shrink, SMALLEST)
    scale = min((WIDTH - 2 * MARGIN) / wide, (HIGHEST - 2 * MARGIN) / tall)
    height = min(max(tall * scale + 2 * MARGIN, LOWEST), HIGHEST)
    centre = (min(east) + max(east)) / 2

    def x(degrees: float) -> float:
        return WIDTH / 2 + (degrees - centre) * shrink * scale

    def y(degrees: float) -> float:
        return height / 2 - (degrees - middle) * scale

    cells: dict[tuple[int, int], list[int]] = defaultdict(list)
    for number, (longitude, latitude) in enumerate(zip(east, north, strict=True)):
        cells[floor(x(longitude) / CELL), floor(y(latitude) / CELL)].append(number)
    places = []
    for members in cells.values():
        worst = max(members, key=lambda one: points[one][2].rank)
        places.append(
            Place(
                x=round(sum(x(east[one]) for one in members) / len(members), 1),
                y=round(sum(y(north[one]) for one in members) / len(members), 1),
                level=points[worst][2],
                count=len(members),
                name=points[worst][1],
                code=points[worst][0],
                area=_area([(points[one][3], points[one][4], east[one]) for one in members]),
            )
        )
    step = _nice(APART / scale)
    bar = _nice(0.3 * WIDTH / scale * KILOMETRES)
    return Map(
        height=round(height),
        places=sorted(places, key=lambda one: one.level.rank),  # the worst is drawn last, above the others
        meridians=list(
            _lines(centre, (WIDTH / 2 - EDGE) / scale / shrink, _nice(APART / scale / shrink), x, shift, "EW")
        ),
        parallels=list(_lines(middle, (height / 2 - EDGE) / scale, step, y, 0.0, "NS")),
        bar=round(bar / KILOMETRES * scale, 1),
        bar_name=f"{bar:g} km" if bar >= 1 else f"{1000 * bar:g} m",
        is_named=len(places) <= NAMED,
    )


def _shift(longitudes: Sequence[float]) -> float:
    """Longitude from which all others are counted eastwards, so that no group is torn at the date line."""
    if max(longitudes) - min(longitudes) <= 180:
        return min(longitudes)
    return min((one for one in longitudes if one >= 0), default=min(longitudes))


def _area(members: Sequence[tuple[float, float, float]]) -> str:
    """South, west, north and east of some (latitude, longitude, degrees east of the first), a little enlarged."""
    edge = 0.0005
    by_east = sorted(members, key=lambda one: one[2])
    south, north = min(one[0] for one in members) - edge, max(one[0] for one in members) + edge
    west, east = max(by_east[0][1] - edge, -180.0), min(by_east[-1][1] + edge, 180.0)
    return ",".join(f"{value:.4f}" for value in (max(south, -90.0), west, min(north, 90.0), east))


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
