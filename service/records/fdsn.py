"""What is stored, as FDSN web services hand it out: StationXML and miniSEED (FDSN Web Service Specifications 1.2)."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from io import BytesIO
from itertools import groupby, zip_longest
from operator import attrgetter, itemgetter
from time import monotonic
from typing import Any

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
from service.buildings.description import BuildingFile
from service.buildings.store import described
from service.buildings.tables import Building
from service.db.blobs import decode
from service.db.select import Line
from service.records import waveform_queries
from service.records.fdsn_query import Area, Selection, TooMuchError, codes, is_match

UNITS: dict[Quantity, str] = {
    "acceleration": "M/S**2",
    "velocity": "M/S",
    "displacement": "M",
    "temperature": "CELSIUS",
}


DEADLINE = 10.0
"""s that finding what is wanted may take."""
UNKNOWN = "The place is not known: latitude and longitude stand at 0 because StationXML wants numbers."


@dataclass(frozen=True, slots=True)
class Epoch:
    """A channel as long as its gain and rate stay what they are."""

    building: Building
    file: BuildingFile
    row: Line
    end: datetime

    @property
    def codes(self) -> list[str]:
        """Network, station, location and channel."""
        return list(self.row.channel.split("."))


def inventory(session: Session, wanted: Sequence[Selection], area: Area | None) -> Inventory:
    """Networks, stations and channels of which something is stored; a channel's epoch ends where its gain changes."""
    chooser = Chooser()
    chosen = [epoch for epoch in _epochs(session) if any(_is_of(epoch, one, chooser) for one in wanted)]
    if area is not None:
        chosen = [epoch for epoch in chosen if area.holds(epoch.file.latitude, epoch.file.longitude)]
    chosen.sort(key=lambda epoch: (epoch.row.channel, epoch.row.start))
    networks = groupby(chosen, key=lambda epoch: epoch.codes[0])
    return Inventory([Network(code, list(_stations(epochs))) for code, epochs in networks], source="menshin")


def _epochs(session: Session) -> Iterator[Epoch]:
    """All epochs; none of a channel reaches into its next one."""
    for building, rows in groupby(waveform_queries.epochs(session), key=itemgetter(0)):
        file = described(session, building)
        for _, spans in groupby((row for _, row in rows), key=attrgetter("channel")):
            epochs = list(spans)
            for row, following in zip_longest(epochs, epochs[1:]):
                yield Epoch(building, file, row, min(row.end, following.start) if following else row.end)


def _is_of(epoch: Epoch, wanted: Selection, chooser: "Chooser") -> bool:
    inside = UTCDateTime(epoch.row.start) <= wanted.end and UTCDateTime(epoch.end) >= wanted.start
    return chooser.is_wanted(epoch.row.channel, wanted) and bool(inside)


def _stations(epochs: Iterable[Epoch]) -> Iterator[Station]:
    for code, group in groupby(epochs, key=lambda epoch: epoch.codes[1]):
        members = list(group)
        start = min(epoch.row.start for epoch in members)
        name = f"{members[0].building.name}{'' if _is_placed(members[0].file) else ' (place not known)'}"
        yield Station(
            code,
            **_place(members[0].file),
            site=Site(name),
            start_date=UTCDateTime(start),
            channels=[_channel(epoch) for epoch in members],
        )


def _is_placed(file: BuildingFile) -> bool:
    return file.latitude is not None and file.longitude is not None


def _place(file: BuildingFile) -> dict[str, Any]:
    """Where it is; where that is not known a comment says so."""
    comments = [] if _is_placed(file) else [Comment(UNKNOWN)]
    return {
        "latitude": file.latitude or 0.0,
        "longitude": file.longitude or 0.0,
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


class Chooser:
    """Which channels are wanted, each looked at once for each selection; it gives up at a deadline."""

    def __init__(self, seconds: float = DEADLINE) -> None:
        self._end = monotonic() + seconds
        self._found: dict[tuple[str, ...], bool] = {}

    def is_wanted(self, channel: str, wanted: Selection) -> bool:
        """Whether an id's four codes match the lists of wildcards.

        Raises
        ------
        TooMuchError
            The deadline is over.
        """
        lists = (wanted.network, wanted.station, wanted.location, wanted.channel)
        found = self._found.get((channel, *lists))
        if found is None:
            self.look_at_the_clock()
            names = ("network", "station", "location", "channel")
            found = self._found[channel, *lists] = all(
                any(is_match(code, pattern) for pattern in codes(name, patterns))
                for name, code, patterns in zip(names, channel.split("."), lists, strict=True)
            )
        return found

    def look_at_the_clock(self) -> None:
        """Go on if there is time left.

        Raises
        ------
        TooMuchError
            There is none.
        """
        if monotonic() > self._end:
            raise TooMuchError("the question takes too long to answer; fewer channels or less time would do")


def miniseed(session: Session, selections: Sequence[Selection], most: int) -> bytes | None:
    """The wanted samples as they came, numbers not yet multiplied by their gain; None if there are none.

    Raises
    ------
    TooMuchError
        They are more than `most`.
    """
    chooser = Chooser()
    found, count = [], 0
    stored = _pieces(session, selections)
    for wanted in selections:
        chooser.look_at_the_clock()
        pieces = [one for one in stored if _overlaps(one, wanted) and chooser.is_wanted(one.row.channel, wanted)]
        count += sum(_count(piece.row, wanted) for piece in pieces)
        if count > most:
            raise TooMuchError(
                f"{count} samples match, and {most} are given at once; fewer channels or less time would do"
            )
        found.append((wanted, pieces))
    stream = Stream()
    for wanted, chosen in found:
        for piece in waveform_queries.samples(session, [piece.row.id for piece in chosen]):
            chooser.look_at_the_clock()
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


def _pieces(session: Session, selections: Sequence[Selection]) -> list[Piece]:
    """All that is stored between the first start and the last end of the selections."""
    start, end = (min(one.start for one in selections), max(one.end for one in selections))
    return [
        Piece(row, (begun := row.start.timestamp()), begun + row.count / row.rate)
        for row in waveform_queries.pieces(session, _time(start), _time(end))
    ]


def _overlaps(piece: Piece, wanted: Selection) -> bool:
    return bool(piece.start <= wanted.end.timestamp and piece.end >= wanted.start.timestamp)


def _count(piece: Line, wanted: Selection) -> int:
    """Number of samples of a piece in the wanted time, give or take one."""
    start = UTCDateTime(piece.start)
    seconds = min(wanted.end, start + piece.count / piece.rate) - max(wanted.start, start)
    return max(0, int(seconds * piece.rate))


def _time(time: UTCDateTime) -> datetime:
    return datetime.fromtimestamp(time.timestamp, UTC)


def _header(channel: str, start: datetime, rate: float) -> dict[str, Any]:
    network, station, location, code = channel.split(".")
    header = {"network": network, "station": station, "location": location, "channel": code}
    return header | {"starttime": UTCDateTime(start), "sampling_rate": rate}
