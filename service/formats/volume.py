"""What the volume 2 files of all strong-motion networks share: records that end with a line, numbers in columns.

Fortran programs write them: numbers stand in columns of fixed width and may touch, and a format such as (8F10.5) says
how. A header prints the peak of each series, which tells a damaged file from a sound one.
"""

import re
from collections.abc import Sequence

import numpy as np

from core.arrays import Vector
from service.formats.errors import FormatError

PRINTED = 0.001
"""The last digit of the peaks that headers print, in the file's units."""


def records(name: str, data: bytes, end: re.Pattern[str]) -> list[list[str]]:
    """The lines of each record of a file, without the line that ends it.

    Raises:
        FormatError: no line ends a record, or something follows the last that does.
    """
    found: list[list[str]] = []
    lines: list[str] = []
    for line in data.decode("ascii", errors="replace").splitlines():
        if end.match(line):
            found.append(lines)
            lines = []
        else:
            lines.append(line)
    if not found or any(line.strip("\x1a ") for line in lines):  # Ctrl-Z ended files of older systems
        raise FormatError(f"{name} is truncated: no line says 'End of data' below its last numbers; fetch it again")
    return found


def first_match(name: str, lines: Sequence[str], pattern: re.Pattern[str], label: str) -> tuple[int, re.Match[str]]:
    """Where the first line stands that has what a header must have, and what was found in it."""
    for at, line in enumerate(lines):
        if found := pattern.search(line):
            return at, found
    raise FormatError(f"the header of {name} has no {label!r}; a volume 2 file with it would do")


def numbers_in_columns(what: str, lines: Sequence[str], count: int, columns: int, width: int) -> Vector:
    """(count,) in the file's units, from the first lines, which have so many columns of so many characters."""
    rows = lines[: -(-count // columns)]
    text = "".join(row.ljust(columns * width)[: columns * width] for row in rows)
    fields = np.frombuffer(text.encode("ascii", errors="replace"), dtype=f"S{width}")[:count]
    try:
        numbers = fields.astype(np.float64)
    except ValueError:
        numbers = np.empty(0)
    if numbers.size != count:
        raise FormatError(f"{what} is truncated or damaged: {count} numbers of {width} columns would do")
    return numbers


def sampling_rate(what: str, interval: str) -> float:
    """Hz, of an interval in s."""
    try:
        return 1 / float(interval)
    except (ValueError, ZeroDivisionError):
        raise FormatError(f"the interval between samples of {what} is {interval} s; one above 0 would do") from None


def check_peak(what: str, numbers: Vector, printed: float | None, digit: float = PRINTED) -> None:
    """Refuse a series whose largest magnitude is not the printed one, to the last printed digit.

    Args:
        what: for the message.
        numbers: (n,) in the file's units.
        printed: the peak that the header prints, of either sign; None where it prints none.
        digit: the coarser of the last digits of the peak and of the series.
    """
    found = float(np.abs(numbers).max()) if numbers.size else 0.0
    if printed is not None and not abs(found - abs(printed)) <= digit:
        raise FormatError(f"{what} is damaged: its peak is {found:.3f}, its header prints {abs(printed):.3f}")
