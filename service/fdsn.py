"""What is stored, as FDSN web services hand it out: StationXML and miniSEED (FDSN Web Service Specifications 1.2)."""

from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from fnmatch import fnmatchcase
from io import BytesIO
from itertools import groupby
from typing import Any

from obspy import Inventory, Stream, Trace, UTCDateTime
from obspy.core.inventory import (
    Channel,
    InstrumentSensitivity,
    Network,
    Response,
    ResponseStage,
    Site,
    Station,
)
from sqlalchemy.orm import Session

from core.record import Quantity
from service import queries
from service.blobs import decode
from service.building_file import BuildingFile
from service.buildings import described
from service.fdsn_query import Selection
from service.queries import Line

UNITS: dict[Quantity, str] = {
    "acceleration": "M/S**2",
    "velocity": "M/S",
    "displacement": "M",
    "temperature": "CELSIUS",
}


def inventory(session: Session, wanted: Selection) -> Inventory:
    """Networks, stations and channels of which something is stored; a channel's epoch ends where its gain changes."""
    found = [(building, row, described(session, building)) for building, row in queries.epochs(session)]
    chosen = [one for one in found if is_wanted(one[1].channel, wanted) and overlaps(one[1], wanted)]
    chosen.sort(key=lambda one: (one[1].channel, one[1].start))
    networks = groupby(chosen, key=lambda one: one[1].channel.split(".")[0])
    return Inventory([Network(code, list(_stations(list(rows)))) for code, rows in networks], source="menshin")


def _stations(rows: list[Any]) -> Iterator[Station]:
    for code, group in groupby(rows, key=lambda one: one[1].channel.split(".")[1]):
        members = list(group)
        building, _, file = members[0]
        start = min(row.start for _, row, _ in members)
        station = Station(code, *_place(file), 0.0, site=Site(building.name), start_date=UTCDateTime(start))
        station.channels = [_channel(row, described_by) for _, row, described_by in members]
        yield station


def _place(file: BuildingFile) -> tuple[float, float]:
    """Latitude and longitude; StationXML wants some, so a building without a place lies at 0, 0."""
    return file.latitude or 0.0, file.longitude or 0.0


def _channel(row: Line, file: BuildingFile) -> Channel:
    sensor = next((one for one in file.description.channels if one.id == row.channel), None)
    response = None if sensor is None else _response(UNITS[sensor.quantity], 1.0 / row.gain)
    _, _, location, code = row.channel.split(".")
    return Channel(
        code,
        location,
        *_place(file),
        elevation=0.0,
        depth=0.0,
        sample_rate=row.rate,
        start_date=UTCDateTime(row.start),
        end_date=UTCDateTime(row.end),
        description=None if sensor is None else f"{sensor.level}, {sensor.quantity}",
        response=response,
    )


def _response(unit: str, counts: float) -> Response:
    sensitivity = InstrumentSensitivity(counts, 1.0, unit, "COUNTS")
    return Response(instrument_sensitivity=sensitivity, response_stages=[ResponseStage(1, counts, 1.0, unit, "COUNTS")])


def is_wanted(channel: str, wanted: Selection) -> bool:
    """Whether an id's four codes match the lists of wildcards."""
    lists = (wanted.network, wanted.station, wanted.location, wanted.channel)
    return all(
        any(fnmatchcase(code, "" if pattern == "--" else pattern) for pattern in patterns.split(","))
        for code, patterns in zip(channel.split("."), lists, strict=True)
    )


def overlaps(row: Line, wanted: Selection) -> bool:
    """Whether something of it lies in the wanted time."""
    return bool(UTCDateTime(row.start) <= wanted.end and UTCDateTime(row.end) >= wanted.start)


def miniseed(session: Session, selections: Sequence[Selection]) -> bytes | None:
    """The wanted samples as they came, numbers not yet multiplied by their gain; None if there are none."""
    stream = Stream()
    for wanted in selections:
        pieces = queries.pieces(session, _time(wanted.start), _time(wanted.end))
        numbers = [piece.id for piece in pieces if is_wanted(piece.channel, wanted)]
        for piece in queries.samples(session, numbers):
            trace = Trace(decode(piece.samples), _header(piece.channel, piece.start, piece.rate))
            stream.append(trace.trim(wanted.start, wanted.end))
    stream.traces = [trace for trace in stream if trace.stats.npts]
    if not stream:
        return None
    out = BytesIO()
    stream.sort().write(out, format="MSEED")
    return out.getvalue()


def _time(time: UTCDateTime) -> datetime:
    return datetime.fromtimestamp(time.timestamp, UTC)


def _header(channel: str, start: datetime, rate: float) -> dict[str, Any]:
    network, station, location, code = channel.split(".")
    header = {"network": network, "station": station, "location": location, "channel": code}
    return header | {"starttime": UTCDateTime(start), "sampling_rate": rate}
