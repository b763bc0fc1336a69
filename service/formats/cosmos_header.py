"""What stands above a series in a COSMOS volume 2 file: lines of text, and two tables whose entries have numbers.

Format: COSMOS Strong Motion Programs Board (2001), COSMOS Strong Motion Data Format, version 1.20.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite

from service.formats.errors import FormatError
from service.formats.volume import first_match, numbers_in_columns

UNKNOWN = re.compile(r"unknown/unspecified:\s*(-?\d+)[,\s]+(-?\d+\.?\d*)", re.IGNORECASE)
LAYOUT = (
    r"Format\s*+(?:=\s*+)?\(\s*+(?:\d++P,?)?"
    r"(?P<columns>[1-9]\d?)?(?P<kind>[EFGI])(?P<width>[1-9]\d?)(?:\.(?P<decimals>\d))?"
)
"""Of numbers in columns, as Fortran says it. Repetitions are possessive (`*+`): a search takes linear time."""
TABLE = r"^\s*(?P<count>\d{1,9})\s+%s-header values follow on\s+(?P<rows>\d{1,9})\s+lines,?\s*+" + LAYOUT


@dataclass(frozen=True, slots=True)
class Header:
    """What stands above a series."""

    name: str
    lines: Sequence[str]
    unknown: float
    """What stands for a real, or a sample, that is not known."""
    integers: Mapping[int, float]
    """By number, those that are known."""
    reals: Mapping[int, float]
    """By number, those that are known."""

    def integer(self, number: int, meaning: str) -> int:
        """An integer that must be known."""
        if number not in self.integers:
            raise FormatError(f"{self.name} has no {meaning} (integer {number} of its header); a file with it would do")
        return int(self.integers[number])

    def real(self, number: int, meaning: str) -> float:
        """A real that must be known."""
        if number not in self.reals:
            raise FormatError(f"{self.name} has no {meaning} (real {number} of its header); a file with it would do")
        return self.reals[number]


def header_of(name: str, lines: Sequence[str]) -> Header:
    """What a header says.

    Raises:
        FormatError: a table is missing or damaged, or nothing says what stands for the unknown.
    """
    _, unknown = first_match(name, lines, UNKNOWN, "Values used when parameter or data value is unknown/unspecified:")
    return Header(
        name=name,
        lines=lines,
        unknown=float(unknown[2]),
        integers=_table(name, lines, "Integer", float(unknown[1])),
        reals=_table(name, lines, "Real", float(unknown[2])),
    )


def _table(name: str, lines: Sequence[str], kind: str, unknown: float) -> Mapping[int, float]:
    """The entries that are known, by number."""
    pattern = re.compile(TABLE % kind, re.IGNORECASE)
    at, table = first_match(name, lines, pattern, f"100 {kind}-header values follow on ... lines, Format= (...)")
    rows = lines[at + 1 : at + 1 + int(table["rows"])]
    what = f"the table of {kind.lower()}s of {name}"
    values = numbers_in_columns(what, rows, int(table["count"]), int(table["columns"] or 1), int(table["width"]))
    return {
        number: float(value) for number, value in enumerate(values, start=1) if value != unknown and isfinite(value)
    }
