"""Formats of records: bytes in, traces out, without a database or settings; `read` recognises the format itself."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from service.formats.format_errors import FormatError, UnknownFormatError, UnknownUnitError
from service.formats.units import Gain

if TYPE_CHECKING:
    from service.formats.reading import read
    from service.formats.trace import Contents, Trace, of_building

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
_MODULES = {"Contents": "trace", "Trace": "trace", "of_building": "trace", "read": "reading"}
"""Modules that are imported once a name of theirs is used: building files need units and errors only."""


def __getattr__(name: str) -> Any:  # noqa: ANN401  a class or a function
    if name not in _MODULES:
        raise AttributeError(f"module 'service.formats' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(f"service.formats.{_MODULES[name]}"), name)
    return value
