"""Requests to an FDSN web service, read from an address or from posted lines.

International Federation of Digital Seismograph Networks, FDSN Web Service Specifications 1.2 (2019).
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache

from obspy import UTCDateTime

EARLIEST, LATEST = UTCDateTime(1900, 1, 1), UTCDateTime(2599, 12, 31)
ALIASES = {
    "net": "network",
    "sta": "station",
    "loc": "location",
    "cha": "channel",
    "start": "starttime",
    "end": "endtime",
    "minlat": "minlatitude",
    "maxlat": "maxlatitude",
    "minlon": "minlongitude",
    "maxlon": "maxlongitude",
    "minmag": "minmagnitude",
    "maxmag": "maxmagnitude",
}
_PLACE = {"minlatitude": "south", "maxlatitude": "north", "minlongitude": "west", "maxlongitude": "east"}
SELECTION = ("network", "station", "location", "channel", "starttime", "endtime", "nodata")
PARAMETERS = {
    "station": (*SELECTION, *_PLACE, "level", "format"),
    "dataselect": (*SELECTION, "format"),
    "event": (
        *("starttime", "endtime", *_PLACE, "mindepth", "maxdepth", "minmagnitude", "maxmagnitude"),
        *("orderby", "limit", "nodata", "format"),
    ),
}
"""The parameters that each service understands, by their long names."""


MOST_CODES, MOST_LINES = 50, 500
"""Codes in one list, and selections in one request."""
CODE = re.compile(r"[A-Za-z0-9?*-]{0,8}")
"""A code with wildcards; of the specifications' codes the longest have 5 characters, of SEED's newest identifiers 8."""


class QueryError(Exception):
    """An invalid request; the message gives the remedy."""

    status = 400


class TooMuchError(QueryError):
    """A request for more than is returned at once."""

    status = 413


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """Channels and a span of time; the codes are lists with wildcards as in the specification."""

    network: str = "*"
    station: str = "*"
    location: str = "*"
    channel: str = "*"
    start: UTCDateTime = EARLIEST
    end: UTCDateTime = LATEST

    def __post_init__(self) -> None:
        for name in ("network", "station", "location", "channel"):
            codes(name, getattr(self, name))
        if self.start > self.end:
            raise QueryError(f"starttime {self.start} lies after endtime {self.end}")


@lru_cache(maxsize=4 * MOST_LINES)
def codes(name: str, text: str) -> tuple[str, ...]:
    """The codes of a list, each at most 8 letters, digits, hyphens and wildcards; `--` is an empty one."""
    given = tuple(dict.fromkeys(one.strip() for one in text.split(",", MOST_CODES + 1)))
    if text.count(",") >= MOST_CODES:
        raise TooMuchError(f"{name} lists more than {MOST_CODES} codes; use wildcards or several requests")
    if wrong := next((one for one in given if not CODE.fullmatch(one)), None):
        raise QueryError(f"{name} {wrong[:20]!r} is not a code: use up to 8 letters, digits, hyphens, ? and *")
    return tuple("" if one == "--" else one for one in given)


@lru_cache(maxsize=2**16)
def is_match(code: str, pattern: str) -> bool:
    """True if a code matches a pattern; the time grows with the product of their lengths."""
    reached = {0}
    for character in code:
        after = {i + 1 for i in _spread(reached, pattern) if i < len(pattern) and pattern[i] in ("?", character)}
        reached = after | {i for i in _spread(reached, pattern) if i < len(pattern) and pattern[i] == "*"}
    return len(pattern) in _spread(reached, pattern)


def _spread(reached: set[int], pattern: str) -> set[int]:
    """Positions in the pattern that are reached past stars, without a further character."""
    places = set(reached)
    for i in sorted(reached):
        while i < len(pattern) and pattern[i] == "*":
            i += 1
            places.add(i)
    return places


@dataclass(frozen=True, slots=True, kw_only=True)
class Area:
    """Limits of the stations' coordinates, °; a station without coordinates lies in no area."""

    south: float = -90.0
    north: float = 90.0
    west: float = -180.0
    east: float = 180.0

    def holds(self, latitude: float | None, longitude: float | None) -> bool:
        """True if a place lies in the area."""
        if latitude is None or longitude is None:
            return False
        return self.south <= latitude <= self.north and self.west <= longitude <= self.east


def parameters(service: str, given: Iterable[tuple[str, str]]) -> dict[str, str]:
    """The parameters by their long names, without empty ones; unknown ones are errors."""
    named = {ALIASES.get(name.lower(), name.lower()): value for name, value in given}
    if unknown := sorted(set(named) - set(PARAMETERS[service])):
        raise QueryError(f"the {service} service has no parameter {', '.join(unknown)}")
    if named.get("nodata", "204") not in {"204", "404"}:
        raise QueryError(f"nodata must be 204 or 404, got {named['nodata']}")
    return {name: value for name, value in named.items() if value != ""}


def selection(named: Mapping[str, str]) -> Selection:
    """The channels and times in the parameters."""
    return Selection(
        network=named.get("network", "*"),
        station=named.get("station", "*"),
        location=named.get("location", "*"),
        channel=named.get("channel", "*"),
        start=time(named["starttime"]) if "starttime" in named else EARLIEST,
        end=time(named["endtime"]) if "endtime" in named else LATEST,
    )


def area(named: Mapping[str, str]) -> Area | None:
    """The area in the parameters; None if they set no limit."""
    limits = {side: degrees(named, name) for name, side in _PLACE.items() if name in named}
    return Area(**limits) if limits else None


def degrees(named: Mapping[str, str], name: str) -> float:
    """A latitude or a longitude."""
    most = 90.0 if name.endswith("latitude") else 180.0
    try:
        angle = float(named[name])
    except ValueError as error:
        raise QueryError(f"{name} must be a number of degrees, got {named[name]}") from error
    if not -most <= angle <= most:
        raise QueryError(f"{name} must lie between -{most:.0f} and {most:.0f} degrees, got {named[name]}")
    return angle


def posted(body: str) -> tuple[dict[str, str], list[Selection]]:
    """Parameters and selections of a posted request: `name=value` lines, then a line per selection."""
    named: dict[str, str] = {}
    selections: list[Selection] = []
    for line in filter(None, map(str.strip, body.splitlines())):
        words = line.split()
        if len(selections) >= MOST_LINES or len(named) > MOST_LINES:
            raise TooMuchError(f"more than {MOST_LINES} lines were posted; use several requests")
        if "=" in line:
            name, _, value = line.partition("=")
            named[name.strip().lower()] = value.strip()
        elif len(words) == 6:
            keys = ("network", "station", "location", "channel", "starttime", "endtime")
            selections.append(selection(dict(zip(keys, words, strict=True))))
        else:
            raise QueryError(f"'{line[:80]}' should be network, station, location, channel, starttime and endtime")
    return named, selections


def time(text: str) -> UTCDateTime:
    """A UTC time as the specification writes it, `2024-01-31T12:00:00.000000`."""
    try:
        return UTCDateTime(text)
    except (TypeError, ValueError) as error:
        raise QueryError(f"'{text[:40]}' is not a time; write 2024-01-31T12:00:00") from error
