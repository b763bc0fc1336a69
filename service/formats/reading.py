"""Reading of files in any format, recognised by their bytes, and of zip archives of them, which are bounded."""

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from types import MappingProxyType
from zipfile import ZipFile

from service.formats.cosmos import is_cosmos, read_cosmos
from service.formats.csmip import is_csmip, read_csmip
from service.formats.csv_table import is_csv, read_csv
from service.formats.fdsn_xml import is_stationxml, read_stationxml
from service.formats.format_errors import FormatError, UnknownFormatError, UnknownUnitError
from service.formats.trace import Contents
from service.formats.units import Gain
from service.formats.waveforms import is_knet, is_miniseed, is_sac, read_knet, read_miniseed, read_sac

HTML = re.compile(rb"\s*<(!doctype\s+html|html)\b", re.IGNORECASE)
TITLE = re.compile(rb"<title[^>]*>(.*?)</title>", re.IGNORECASE | re.DOTALL)
DESCRIPTION = re.compile(rb"^\[(\[level\]|isolation|effects\.)", re.MULTILINE)
"""A table of a building file or a model file."""
BEGINNING = 2**16
"""Bytes in which such a file has one: records are long, and each is searched."""
ZIP = (b"PK\x03\x04", b"PK\x05\x06")
"""Beginnings of a zip archive."""
LARGEST = 256 * 2**20
"""Bytes of all members of an archive together."""
MOST_MEMBERS = 10_000
"""Most files in an archive. Not tuned: a bound on hostile archives."""
LARGEST_RATIO = 100
"""Bytes of all members to one of the archive, beyond SMALL: records compress 3 to 10 times."""
SMALL = 32 * 2**20
"""Bytes, of all members together, that any archive may unpack to."""


@dataclass(frozen=True, slots=True)
class Format:
    """A format: how to recognise it, and how to read it."""

    name: str
    recognises: Callable[[bytes], bool]
    read: Callable[[str, bytes, Mapping[str, Gain]], Contents]


FORMATS = (
    Format("miniSEED", is_miniseed, read_miniseed),
    Format("StationXML", is_stationxml, read_stationxml),
    Format("K-NET or KiK-net ASCII", is_knet, read_knet),
    Format("CSMIP V2", is_csmip, read_csmip),
    Format("COSMOS V2", is_cosmos, read_cosmos),
    Format("CSV", is_csv, read_csv),
    Format("SAC", is_sac, read_sac),  # last: only two bytes in the middle identify it
)


def read(name: str, data: bytes, gains: Mapping[str, Gain] = MappingProxyType({})) -> Contents:
    """The contents of a file, or of a zip archive of files.

    Neither a database nor settings are needed:

    >>> text = b"# start: 2024-01-01T00:00:00Z\\n# rate: 100\\nXX.TOWER.00.HNX [gal]\\n1.5\\n-2.0\\n"
    >>> [trace] = read("tower.csv", text).traces
    >>> trace.channel, trace.rate, trace.quantity
    ('XX.TOWER.00.HNX', 100.0, 'acceleration')
    >>> trace.to_si()
    array([ 0.015, -0.02 ])

    Args:
        name: for messages only; the bytes determine the format.
        data: the file.
        gains: by channel id, for formats that do not state the unit of their numbers (miniSEED, SAC).

    Raises:
        UnknownUnitError: the unit of its channels is not known; the message names them, and not the file.
        FormatError: the file cannot be used; nothing of a broken file is returned.
    """
    if data.startswith(ZIP):
        return _read_zip(name, data, gains)
    return _read_named(name, data, gains)


def _read_named(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """The contents; an error names the file, even if it concerns one of its channels."""
    try:
        return _read_plain(name, data, gains)
    except UnknownUnitError:
        raise
    except FormatError as error:
        if name in str(error):
            raise
        raise FormatError(f"{name}: {error}") from error


def _read_plain(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    if not data:
        raise FormatError(f"{name} is empty; fetch it again")
    if HTML.match(data):
        title = TITLE.search(data[:4096])
        says = title[1].decode(errors="replace").strip() if title else "without a title"
        raise FormatError(f"{name} is an HTML page ({says}), not data; check the address that answered with it")
    if DESCRIPTION.search(data, 0, BEGINNING):
        raise FormatError(f"{name} is a building or model file (TOML), not a record; name files of records here")
    for form in FORMATS:
        if form.recognises(data):
            return form.read(name, data, gains)
    raise UnknownFormatError(
        f"{name} has an unknown format (it begins with {data[:24]!r}); "
        f"use {', '.join(form.name for form in FORMATS)} or a zip archive of these"
    )


def _read_zip(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """The joint contents of an archive's members; StationXML among them serves the others.

    A member of no known format is skipped with a remark, as archives carry spectra and notes beside their records.
    """
    stations = ((member, content) for member, content in _members(name, data) if is_stationxml(content))
    parts = [_read_named(f"{name}/{member}", content, gains) for member, content in stations]
    known = {**{channel: gain for contents in parts for channel, gain in contents.gains.items()}, **gains}
    remarks: list[str] = []
    for member, content in _members(name, data):
        if is_stationxml(content):
            continue
        try:
            parts.append(_read_named(f"{name}/{member}", content, known))
        except UnknownFormatError as error:
            remarks.append(str(error))
    if not parts:
        raise FormatError(f"{name} holds no file of a known format; {'; '.join(remarks[:3]) or 'it is empty'}")
    return _together(parts, tuple(remarks))


def _together(parts: list[Contents], remarks: tuple[str, ...]) -> Contents:
    traces = tuple(trace for contents in parts for trace in contents.traces)
    return Contents(
        kind="waveforms" if traces else "station",
        traces=traces,
        gains={channel: gain for contents in parts for channel, gain in contents.gains.items()},
        without_unit=tuple(channel for contents in parts for channel in contents.without_unit),
        remarks=tuple(remark for contents in parts for remark in contents.remarks) + remarks,
    )


def _members(name: str, data: bytes) -> Iterator[tuple[str, bytes]]:
    """The files by name, unpacked one at a time; of several with one name the last."""
    bound = min(LARGEST, max(SMALL, LARGEST_RATIO * len(data)))
    with _readable(name):
        archive = ZipFile(BytesIO(data))
        infos = [info for info in archive.infolist() if not info.is_dir()]
    if len(infos) > MOST_MEMBERS:
        raise FormatError(f"{name} has {len(infos)} members; at most {MOST_MEMBERS} are accepted")
    left = bound
    for member, info in {info.filename: info for info in infos}.items():
        with _readable(name), archive.open(info) as opened:
            content = opened.read(left + 1)  # the directory's sizes are only claims
        if len(content) > left:
            raise FormatError(
                f"{name} has {len(data)} bytes and unpacks to more than {bound}; use smaller archives, or ones packed "
                f"at most {LARGEST_RATIO} times"
            )
        left -= len(content)
        yield member, content


@contextmanager
def _readable(name: str) -> Iterator[None]:
    """Turn any error of the zip reader into a FormatError."""
    try:
        yield
    except MemoryError:
        raise
    except Exception as error:  # it raises whatever a broken archive makes it stumble over
        raise FormatError(f"{name} is not a readable zip archive: {error}; fetch it again") from error
