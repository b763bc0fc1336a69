"""Common parts of the volume 2 files of all strong-motion networks: records with an end line, numbers in columns.

Fortran programs write them: numbers are in columns of fixed width and may touch, and a format such as (8F10.5) says
how. A header prints the peak of each series, which distinguishes a damaged file from a sound one.
"""

import re
from collections.abc import Sequence

import numpy as np

from core.arrays import Vector
from service.formats.format_errors import FormatError

LONGEST_LINE = 1024
"""Characters; the formats have 80."""
MOST_LINES = 5_000_000
"""Longest text file of any format, lines."""
HEADER_LINES = 1000
"""In which a header must have whatever it must have; the formats have fewer than 100."""
AT_ONCE = 2**20
"""Characters that are turned into numbers together."""
PRINTED = 0.001
"""The last digit of the peaks that headers print, in the file's units."""


def records(name: str, data: bytes, end: re.Pattern[str]) -> list[list[str]]:
    """The lines of each record of a file, without the line that ends it.

    Raises:
        FormatError: no line ends a record, something follows the last that does, or a line is far too long.
    """
    blocks: list[list[str]] = []
    lines: list[str] = []
    for number, line in enumerate(text_lines(name, data.decode("ascii", errors="replace")), start=1):
        if len(line) > LONGEST_LINE:
            raise FormatError(
                f"line {number} of {name} has {len(line)} characters, at most {LONGEST_LINE} are accepted; lines of "
                f"this format have 80"
            )
        if end.match(line):
            blocks.append(lines)
            lines = []
        else:
            lines.append(line)
    if not blocks or any(line.strip("\x1a ") for line in lines):  # Ctrl-Z ended files of older systems
        raise FormatError(f"{name} is truncated: no line says 'End of data' below its last numbers; fetch it again")
    return blocks


def text_lines(name: str, text: str) -> list[str]:
    """The lines of a text file.

    Raises:
        FormatError: it has too many.
    """
    if (count := text.count("\n") + text.count("\r")) > 2 * MOST_LINES:  # where lines end with both
        raise FormatError(f"{name} has about {count} lines, at most {MOST_LINES} are accepted; send shorter files")
    lines = text.splitlines()
    if len(lines) > MOST_LINES:
        raise FormatError(f"{name} has {len(lines)} lines, at most {MOST_LINES} are accepted; send shorter files")
    return lines


def first_match(name: str, lines: Sequence[str], pattern: re.Pattern[str], label: str) -> tuple[int, re.Match[str]]:
    """Position of the first line with a required part of the header, and the match."""
    for at, line in enumerate(lines[:HEADER_LINES]):
        if match := pattern.search(line):
            return at, match
    raise FormatError(f"the header of {name} has no {label!r}; which a volume 2 file needs")


def numbers_in_columns(what: str, lines: Sequence[str], count: int, columns: int, width: int) -> Vector:
    """(count,) in the file's units, from the first lines, which have so many columns of so many characters."""
    rows = lines[: -(-count // columns)]
    together = max(1, AT_ONCE // (columns * width))
    if count > min(len(rows) * columns, sum(map(len, rows))):  # a number has one character at least
        raise FormatError(f"{what} is truncated or damaged: {count} numbers of {width} columns are needed")
    numbers = np.empty(count)
    try:
        for first in range(0, len(rows), together):
            place = slice(first * columns, min((first + together) * columns, count))
            numbers[place] = _fields(rows[first : first + together], columns, width)[: place.stop - place.start]
    except ValueError:
        raise FormatError(f"{what} is truncated or damaged: {count} numbers of {width} columns are needed") from None
    return numbers


def _fields(rows: Sequence[str], columns: int, width: int) -> np.ndarray[tuple[int], np.dtype[np.bytes_]]:
    """Texts in the columns of some rows."""
    text = "".join(row.ljust(columns * width)[: columns * width] for row in rows)
    return np.frombuffer(text.encode("ascii", errors="replace"), dtype=f"S{width}")


def sampling_rate(what: str, interval: str) -> float:
    """Hz, of an interval in s."""
    try:
        return 1 / float(interval)
    except (ValueError, ZeroDivisionError):
        raise FormatError(f"the interval between samples of {what} is {interval} s; it must be above 0") from None


def check_peak(what: str, numbers: Vector, printed: float | None, digit: float = PRINTED) -> None:
    """Refuse a series whose largest magnitude is not the printed one, to the last printed digit.

    Args:
        what: for the message.
        numbers: (n,) in the file's units.
        printed: the peak that the header prints, of either sign; None where it prints none.
        digit: the coarser of the last digits of the peak and of the series.
    """
    peak = float(np.abs(numbers).max()) if numbers.size else 0.0
    if printed is not None and not abs(peak - abs(printed)) <= digit:
        raise FormatError(f"{what} is damaged: its peak is {peak:.3f}, its header prints {abs(printed):.3f}")
