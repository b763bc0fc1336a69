"""Stored channels and samples as StationXML and miniSEED (FDSN Web Service Specifications 1.2, 2019)."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from io import BytesIO
from itertools import groupby, zip_longest
from operator import attrgetter
from time import monotonic
from typing import Any, Literal

from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core.inventory import (
    Channel,
    Comment,
    InstrumentSensitivity,
    Network,
    Response,
    ResponseStage,
    Site,
    Station,
)
from sqlalchemy.orm import Session

from core.record import Quantity
from service.buildings import queries as building_queries
from service.buildings.description import BuildingFile
from service.buildings.store import parsed
from service.buildings.tables import Building
from service.db.blobs import decode
from service.db.select import Line
from service.records import queries
from service.records.fdsn_query import Area, Selection, TooMuchError, codes, is_match
from service.records.sources.source import in_batches

UNITS: dict[Quantity, str] = {
    "acceleration": "M/S**2",
    "velocity": "M/S",
    "displacement": "M",
    "temperature": "CELSIUS",
}


DEADLINE = 10.0
"""s that the search may take."""
MOST_LIKES = 100
"""Patterns of networks and stations that the database compares; with more, all are compared here. Not tuned."""
UNKNOWN = "The place is not known: latitude and longitude are 0 because StationXML requires numbers."


NAMES = ("network", "station", "location", "channel")
Level = Literal["network", "station", "channel", "response"]


Placed = BuildingFile | Line
"""An object with `latitude` and `longitude` in degrees, None where they are not known."""


@dataclass(frozen=True, slots=True)
class Epoch:
    """A span of time in which a channel's gain and rate do not change."""

    building: Building
    file: BuildingFile
    row: Line
    end: datetime

    @property
    def codes(self) -> list[str]:
        """Network, station, location and channel."""
        return list(self.row.channel.split("."))


def inventory(session: Session, wanted: Sequence[Selection], area: Area | None, level: Level) -> Inventory:
    """Networks, stations and channels with stored samples; a channel's epoch ends where its gain changes."""
    match wanted:
        case [Selection(location="*", channel="*") as one] if level in ("network", "station"):
            return _without_channels(session, one, area)
    chooser = Chooser()
    epochs = _epochs(session, wanted, area, chooser)
    chosen = [epoch for epoch in epochs if any(_is_of(epoch, one, chooser) for one in wanted)]
    chosen.sort(key=lambda epoch: (epoch.row.channel, epoch.row.start))
    networks = groupby(chosen, key=lambda epoch: epoch.codes[0])
    return Inventory([Network(code, list(_stations(epochs))) for code, epochs in networks], source="menshin")


def _without_channels(session: Session, wanted: Selection, area: Area | None) -> Inventory:
    """Networks and stations by one statement; one more for each batch of buildings whose place is not stored."""
    rows = queries.stations(session, _patterns([wanted]), _time(wanted.start), _time(wanted.end))
    if (wanted.network, wanted.station) != ("*", "*"):  # SQLite's LIKE takes small letters for large ones
        rows = [row for row in rows if _is_match(row.station.split("."), (wanted.network, wanted.station))]
    missing = [row.building_id for row in rows if row.latitude is None or row.longitude is None]
    described = {
        building.id: parsed(revision)
        for numbers in in_batches(missing)
        for building, revision in building_queries.by_number(session, numbers)
    }
    networks: dict[str, list[Station]] = {}
    for row in rows:
        network, code = row.station.split(".")
        place = described.get(row.building_id, row)
        if area is None or area.holds(place.latitude, place.longitude):
            networks.setdefault(network, []).append(_station(code, row.name, place, row.start, []))
    return Inventory([Network(code, stations) for code, stations in networks.items()], source="menshin")


def _epochs(session: Session, wanted: Sequence[Selection], area: Area | None, chooser: "Chooser") -> Iterator[Epoch]:
    """Epochs of the wanted channels in the area; an epoch ends where the channel's next one begins."""
    channels = _wanted_channels(session, wanted, chooser)
    for numbers in in_batches(sorted(channels)):
        chooser.check_time()
        placed = {
            building.id: (building, file)
            for building, revision in building_queries.by_number(session, numbers)
            for file in [parsed(revision)]
            if area is None or area.holds(file.latitude, file.longitude)
        }
        named = {channel for number in placed for channel in channels[number]}
        rows = queries.epochs(session, list(placed), named) if placed else ()
        for _, spans in groupby(rows, key=attrgetter("building_id", "channel")):
            epochs = list(spans)
            for row, following in zip_longest(epochs, epochs[1:]):
                end = min(row.end, following.start) if following else row.end
                yield Epoch(*placed[row.building_id], row, end)


def _wanted_channels(session: Session, wanted: Sequence[Selection], chooser: "Chooser") -> Mapping[int, Sequence[str]]:
    """The recorded channels that are wanted, by number of the building."""
    channels: dict[int, list[str]] = {}
    for building_id, channel in queries.recorded_channels(session, _patterns(wanted)):
        if any(chooser.is_wanted(channel, one) for one in wanted):
            channels.setdefault(building_id, []).append(channel)
    return channels


def _patterns(wanted: Sequence[Selection]) -> set[str]:
    """LIKE patterns of the networks and stations; one of all if there are too many."""
    patterns = {
        f"{network}.{station}".replace("*", "%").replace("?", "_")
        for one in wanted
        for network in codes("network", one.network)
        for station in codes("station", one.station)
    }
    return patterns if len(patterns) <= MOST_LIKES else {"%.%"}


def _is_of(epoch: Epoch, wanted: Selection, chooser: "Chooser") -> bool:
    inside = UTCDateTime(epoch.row.start) <= wanted.end and UTCDateTime(epoch.end) >= wanted.start
    return chooser.is_wanted(epoch.row.channel, wanted) and bool(inside)


def _stations(epochs: Iterable[Epoch]) -> Iterator[Station]:
    for code, group in groupby(epochs, key=lambda epoch: epoch.codes[1]):
        members = list(group)
        start, of = min(epoch.row.start for epoch in members), members[0]
        yield _station(code, of.building.name, of.file, start, [_channel(epoch) for epoch in members])


def _station(code: str, building: str, place: Placed, start: datetime, channels: list[Channel]) -> Station:
    name = building if _is_known(place) else f"{building} (place not known)"
    return Station(code, **_place(place), site=Site(name), start_date=UTCDateTime(start), channels=channels)


def _is_known(place: Placed) -> bool:
    return place.latitude is not None and place.longitude is not None


def _place(place: Placed) -> dict[str, Any]:
    """Coordinates, with a comment where they are not known."""
    comments = [] if _is_known(place) else [Comment(UNKNOWN)]
    return {
        "latitude": place.latitude or 0.0,
        "longitude": place.longitude or 0.0,
        "elevation": 0.0,
        "comments": comments,
    }


def _channel(epoch: Epoch) -> Channel:
    row = epoch.row
    sensor = next((one for one in epoch.file.description.channels if one.id == row.channel), None)
    response = None if sensor is None else _response(UNITS[sensor.quantity], 1.0 / row.gain)
    return Channel(
        epoch.codes[3],
        epoch.codes[2],
        **_place(epoch.file),
        depth=0.0,
        sample_rate=row.rate,
        start_date=UTCDateTime(row.start),
        end_date=UTCDateTime(epoch.end),
        description=None if sensor is None else f"{sensor.level}, {sensor.quantity}",
        response=response,
    )


def _response(unit: str, counts: float) -> Response:
    sensitivity = InstrumentSensitivity(counts, 1.0, unit, "COUNTS")
    return Response(instrument_sensitivity=sensitivity, response_stages=[ResponseStage(1, counts, 1.0, unit, "COUNTS")])


def _is_match(given: Sequence[str], lists: Sequence[str]) -> bool:
    """True if codes match the lists of wildcards: network, station, and location and channel if they are given."""
    return all(
        any(is_match(code, pattern) for pattern in codes(name, patterns))
        for name, code, patterns in zip(NAMES[: len(lists)], given, lists, strict=True)
    )


class Chooser:
    """Matches channels against selections, each pair once, until a deadline."""

    def __init__(self, seconds: float = DEADLINE) -> None:
        self._end = monotonic() + seconds
        self._found: dict[tuple[str, ...], bool] = {}

    def is_wanted(self, channel: str, wanted: Selection) -> bool:
        """True if an id's four codes match the lists of wildcards.

        Raises:
            TooMuchError: the deadline has passed.
        """
        lists = (wanted.network, wanted.station, wanted.location, wanted.channel)
        is_inside = self._found.get((channel, *lists))
        if is_inside is None:
            self.check_time()
            is_inside = self._found[channel, *lists] = _is_match(channel.split("."), lists)
        return is_inside

    def check_time(self) -> None:
        """Continue if there is time left.

        Raises:
            TooMuchError: there is none.
        """
        if monotonic() > self._end:
            raise TooMuchError("the request takes too long; ask for fewer channels or less time")


def miniseed(session: Session, selections: Sequence[Selection], most: int) -> bytes | None:
    """The wanted samples as recorded, not multiplied by their gain; None if there are none.

    Raises:
        TooMuchError: there are more than `most`.
    """
    chooser = Chooser()
    parts, count = [], 0
    stored = _pieces(session, selections, chooser)
    for wanted in selections:
        chooser.check_time()
        pieces = [one for one in stored if _overlaps(one, wanted) and chooser.is_wanted(one.row.channel, wanted)]
        count += sum(_count(piece.row, wanted) for piece in pieces)
        if count > most:
            raise TooMuchError(
                f"{count} samples match, but at most {most} are returned at once; ask for fewer channels or less time"
            )
        parts.append((wanted, pieces))
    stream = Stream()
    for wanted, chosen in parts:
        for piece in queries.samples(session, [piece.row.id for piece in chosen]):
            chooser.check_time()
            trace = Trace(decode(piece.samples), _header(piece.channel, piece.start, piece.rate))
            stream.append(trace.trim(wanted.start, wanted.end))
    stream.traces = [trace for trace in stream if trace.stats.npts]
    if not stream:
        return None
    out = BytesIO()
    stream.sort().write(out, format="MSEED")
    return out.getvalue()


@dataclass(frozen=True, slots=True)
class Piece:
    """A stored waveform without its samples."""

    row: Line
    start: float
    """s since 1970."""
    end: float


def _pieces(session: Session, selections: Sequence[Selection], chooser: "Chooser") -> list[Piece]:
    """The wanted channels' waveforms between the first start and the last end of the selections."""
    start, end = (min(one.start for one in selections), max(one.end for one in selections))
    channels = _wanted_channels(session, selections, chooser)
    found: list[Piece] = []
    for numbers in in_batches(sorted(channels)):
        chooser.check_time()
        named = {channel for number in numbers for channel in channels[number]}
        for row in queries.pieces(session, numbers, named, _time(start), _time(end)):
            started = row.start.timestamp()
            found.append(Piece(row, started, started + row.count / row.rate))
    return found


def _overlaps(piece: Piece, wanted: Selection) -> bool:
    return bool(piece.start <= wanted.end.timestamp and piece.end >= wanted.start.timestamp)


def _count(piece: Line, wanted: Selection) -> int:
    """Number of samples of a piece in the wanted time, accurate to one."""
    start = UTCDateTime(piece.start)
    seconds = min(wanted.end, start + piece.count / piece.rate) - max(wanted.start, start)
    return max(0, int(seconds * piece.rate))


def _time(time: UTCDateTime) -> datetime:
    return datetime.fromtimestamp(time.timestamp, UTC)


def _header(channel: str, start: datetime, rate: float) -> dict[str, Any]:
    network, station, location, code = channel.split(".")
    header = {"network": network, "station": station, "location": location, "channel": code}
    return header | {"starttime": UTCDateTime(start), "sampling_rate": rate}
