"""What a client of an FDSN web service asks for, read from its address or its posted lines.

International Federation of Digital Seismograph Networks, FDSN Web Service Specifications 1.2 (2019).
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

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
_PLACE = ("minlatitude", "maxlatitude", "minlongitude", "maxlongitude")
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


class QueryError(Exception):
    """The question is not one of the service's; the message says what would do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Selection:
    """Which channels, and from when to when; the codes are lists with wildcards as the specification has them."""

    network: str = "*"
    station: str = "*"
    location: str = "*"
    channel: str = "*"
    start: UTCDateTime = EARLIEST
    end: UTCDateTime = LATEST

    def __post_init__(self) -> None:
        if self.start > self.end:
            raise QueryError(f"starttime {self.start} lies after endtime {self.end}")


def parameters(service: str, given: Iterable[tuple[str, str]]) -> dict[str, str]:
    """The parameters by their long names, without what is empty; those the service does not know are refused."""
    named = {ALIASES.get(name.lower(), name.lower()): value for name, value in given}
    if unknown := sorted(set(named) - set(PARAMETERS[service])):
        raise QueryError(f"the {service} service has no parameter {', '.join(unknown)}")
    if named.get("nodata", "204") not in {"204", "404"}:
        raise QueryError(f"nodata must be 204 or 404, got {named['nodata']}")
    return {name: value for name, value in named.items() if value != ""}


def selection(named: Mapping[str, str]) -> Selection:
    """The channels and times that the parameters ask for."""
    return Selection(
        network=named.get("network", "*"),
        station=named.get("station", "*"),
        location=named.get("location", "*"),
        channel=named.get("channel", "*"),
        start=time(named["starttime"]) if "starttime" in named else EARLIEST,
        end=time(named["endtime"]) if "endtime" in named else LATEST,
    )


def posted(body: str) -> tuple[dict[str, str], list[Selection]]:
    """Parameters and selections of a posted question: `name=value` lines, then a line per selection."""
    named: dict[str, str] = {}
    selections = []
    for line in filter(None, map(str.strip, body.splitlines())):
        words = line.split()
        if "=" in line:
            name, _, value = line.partition("=")
            named[name.strip().lower()] = value.strip()
        elif len(words) == 6:
            keys = ("network", "station", "location", "channel", "starttime", "endtime")
            selections.append(selection(dict(zip(keys, words, strict=True))))
        else:
            raise QueryError(f"'{line}' should be network, station, location, channel, starttime and endtime")
    return named, selections


def time(text: str) -> UTCDateTime:
    """A UTC time as the specification writes it, `2024-01-31T12:00:00.000000`."""
    try:
        return UTCDateTime(text)
    except (TypeError, ValueError) as error:
        raise QueryError(f"'{text}' is not a time; 2024-01-31T12:00:00 would do") from error
