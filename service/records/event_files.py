"""Files grouped into events without a database: paths in, segments of the building's channels out."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from core.record import Segment
from service.buildings.description import BuildingFile
from service.formats import FormatError, Gain, Trace, UnknownUnitError, of_building, read
from service.formats.fdsn_xml import is_stationxml
from service.formats.trace import Span, overlapping

OUTAGE = timedelta(seconds=60)
"""Longest interruption of a logger within one event."""


@dataclass(frozen=True, slots=True)
class EventFiles:
    """One event's samples."""

    start: datetime
    """Time of the first sample."""
    segments: tuple[Segment, ...]


def events(paths: Sequence[Path], building: BuildingFile) -> tuple[EventFiles, ...]:
    """The events in some files, earliest first.

    StationXML comes from among the files, otherwise from the folders they lie in and from the building's folder.

    Raises:
        FormatError: a file that cannot be used, or belongs to another building.
        OSError: a file that cannot be opened.
    """
    contents = {path: path.read_bytes() for path in paths}
    stations = {path: data for path, data in contents.items() if is_stationxml(data)}
    gains = {**_gains(_beside(paths, building)), **_gains(stations), **building.gains}
    distinct = {data: path for path, data in reversed(contents.items()) if path not in stations}
    traces = [trace for data, path in distinct.items() for trace in _traces(path, data, gains, building)]
    return tuple(
        EventFiles(group[0].start, tuple(trace.segment() for trace in group))
        for group in overlapping(traces, _span, OUTAGE)
    )


def _span(trace: Trace) -> Span:
    return trace.start, trace.start + timedelta(seconds=trace.numbers.size / trace.rate)


def _beside(paths: Iterable[Path], building: BuildingFile) -> dict[Path, bytes]:
    """The StationXML files that lie where the records do."""
    folders = {path.resolve().parent for path in paths}
    if building.source is not None and building.source.kind == "folder":
        folders.add(Path(building.source.location))
    stations = (path for folder in sorted(folders) for path in sorted(folder.glob("*.xml")))
    return {path: data for path in stations if is_stationxml(data := path.read_bytes())}


def _gains(stations: Mapping[Path, bytes]) -> dict[str, Gain]:
    gains: dict[str, Gain] = {}
    for path, data in stations.items():
        gains |= read(path.name, data, {}).gains
    return gains


def _traces(path: Path, data: bytes, gains: Mapping[str, Gain], building: BuildingFile) -> tuple[Trace, ...]:
    contents = read(path.name, data, gains)
    wanted = {channel.id for channel in building.description.channels}
    if missing := tuple(channel for channel in contents.without_unit if channel in wanted):
        raise UnknownUnitError(missing)
    try:
        return of_building(contents.traces, building.description.channels)
    except FormatError as error:
        raise FormatError(f"{path.name}: {error}") from None
