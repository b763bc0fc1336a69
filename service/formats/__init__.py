"""Formats of records: bytes in, traces out, without a database or settings; `read` recognises the format itself."""

from service.formats.format_errors import FormatError, UnknownFormatError, UnknownUnitError
from service.formats.reading import read
from service.formats.trace import Contents, Trace, of_building
from service.formats.units import Gain

__all__ = [
    "Contents",
    "FormatError",
    "Gain",
    "Trace",
    "UnknownFormatError",
    "UnknownUnitError",
    "of_building",
    "read",
]
