"""Reading of files in any format, recognised by their bytes."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from service.formats.cosmos import is_cosmos, read_cosmos
from service.formats.csmip import is_csmip, read_csmip
from service.formats.csv_table import is_csv, read_csv
from service.formats.errors import FormatError, UnknownFormatError, UnknownUnitError
from service.formats.fdsn_xml import is_stationxml, read_stationxml
from service.formats.trace import Contents
from service.formats.units import Gain
from service.formats.waveforms import is_knet, is_miniseed, is_sac, read_knet, read_miniseed, read_sac
from service.formats.zipped import Reader, is_zip, read_zip

HTML = re.compile(rb"\s*<(!doctype\s+html|html)\b", re.IGNORECASE)
TITLE = re.compile(rb"<title[^>]*>(.*?)</title>", re.IGNORECASE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Format:
    """A format: how to recognise it, and how to read it."""

    name: str
    recognises: Callable[[bytes], bool]
    read: Reader


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
    if is_zip(data):
        return read_zip(name, data, gains, _read_named)
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
    for form in FORMATS:
        if form.recognises(data):
            return form.read(name, data, gains)
    raise UnknownFormatError(
        f"{name} begins with {data[:24]!r}, as no known format does; "
        f"use {', '.join(form.name for form in FORMATS)} or a zip archive of these"
    )
