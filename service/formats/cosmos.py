"""Records in COSMOS volume 2 files: corrected acceleration, velocity or displacement, each series with its headers.

Format: COSMOS Strong Motion Programs Board (2001), COSMOS Strong Motion Data Format, version 1.20: text header, table
of integers, table of reals, comments, one series, a line that ends it; then the next record. Entries of the tables have
numbers from 1. Version 1.00 numbers them otherwise.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from math import isfinite

import numpy as np

from core.arrays import Vector
from core.record import Quantity
from service.formats.format_errors import FormatError
from service.formats.trace import Contents, Trace
from service.formats.units import Gain, unit_gain
from service.formats.volume2 import PRINTED, check_peak, first_match, numbers_in_columns, records, sampling_rate

FIRST = re.compile(rb"(corrected |velocity|displacement)[^\r\n]{0,200}\(format v", re.IGNORECASE)
"""Raw counts, uncorrected accelerations and response spectra begin otherwise."""
VERSION = re.compile(r"\(format v([\d.]+)", re.IGNORECASE)
STATION = re.compile(r"Code:\s*(\w{1,2})\s*-\s*(\w+)", re.IGNORECASE)
START = re.compile(r"^(?>.*?start time:).*?\b(\d{1,2})\s*:\s*(\d{1,2})\s*:[\s\d.]*(?:UTC|GMT)", re.IGNORECASE)
SENSOR = re.compile(r"Sta Cha\w{0,8}:?\s*+[\d?]{1,8}\s*+:(.*)")
RECORDER = re.compile(r"\(Rcrdr Chan[^)]*\)$")
CODES = re.compile(r"^\s*\|\s*<SCNL>\s*\w+\.(\w+)\.\w+\.([\w-]*)", re.IGNORECASE)
"""Station, channel, network and location, in the comments of networks that give channels no number."""
UNKNOWN = re.compile(r"unknown/unspecified:\s*(-?\d+)[,\s]+(-?\d+\.?\d*)", re.IGNORECASE)
LAYOUT = (
    r"Format\s*+(?:=\s*+)?\(\s*+(?:\d++P,?)?"
    r"(?P<columns>[1-9]\d?)?(?P<kind>[EFGI])(?P<width>[1-9]\d?)(?:\.(?P<decimals>\d))?"
)
"""Fortran's layout of numbers in columns. Repetitions are possessive (`*+`): a search takes linear time."""
TABLE = r"^\s*(?P<count>\d{1,9})\s+%s-header values follow on\s+(?P<rows>\d{1,9})\s+lines,?\s*+" + LAYOUT
SERIES = re.compile(
    r"^\s*+(?P<count>[1-9]\d{0,8})\s++[a-z](?>[^|]*?pts,).*"
    r"units\s*+=\s*+(?P<unit>[^\s,(]{0,40}+)\s*+(?:\(\s*+(?P<code>\d{1,3})\s*+\)\s*+)?,\s*+" + LAYOUT,
    re.IGNORECASE,
)
"""Repetitions are possessive or bounded: a search takes linear time."""
END = re.compile(r"\s*End-of-data for", re.IGNORECASE)

CORRECTED = 2
"""Integer 1: the stage of processing."""
PARAMETERS: Mapping[int, tuple[Quantity, str]] = {
    1: ("acceleration", "ACC"),
    2: ("velocity", "VEL"),
    3: ("displacement", "DIS"),
    4: ("displacement", "REL"),
}
"""Integer 2: what was measured, and its name in the channel's id; 3 is absolute, 4 relative."""
UNITS = {2: "g", 4: "cm/s**2", 5: "cm/s", 6: "cm", 10: "gal", 11: "mg"}
"""Integer 3."""
YEAR, MONTH, DAY, HOUR, MINUTE = 40, 42, 43, 44, 45
"""Integers: start of the record, UTC."""
CHANNEL = 50
"""Integer: number of the channel at the station."""
SECOND, INTERVAL, LENGTH, PEAK = 30, 62, 63, 64
"""Reals: s; ms, of this series (34 is the recorder's); s; in the unit of the series."""


def is_cosmos(data: bytes) -> bool:
    """True if these bytes begin as a COSMOS volume 2 file does, of any version."""
    return FIRST.match(data) is not None


def read_cosmos(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """All records of a file; ids are `<network>.<station>.<channel>.<ACC|VEL|DIS|REL>`."""
    return Contents("waveforms", tuple(_trace(name, lines) for lines in records(name, data, END)))


def _trace(name: str, lines: Sequence[str]) -> Trace:
    _, version = first_match(name, lines, VERSION, "(Format v01.20 with 13 text lines)")
    if version[1] != "01.20":
        raise FormatError(f"{name} is in version {version[1]} of the COSMOS format, with other headers; use 01.20")
    at, series = first_match(name, lines, SERIES, "... acceleration pts, ..., units=cm/sec2 (04), Format=(8F10.5)")
    header = header_of(name, lines[:at])
    quantity, code = _parameter(header)
    channel = f"{_channel(header)}.{code}"
    what = f"{channel} in {name}"
    unit = _unit(what, header, quantity, series)
    sensor = next((_sensor(match[1]) for line in header.lines if (match := SENSOR.search(line))), ())
    return Trace(
        channel=channel,
        start=_start(header),
        rate=sampling_rate(what, str(header.real(INTERVAL, "interval between samples") / 1000)),
        numbers=_numbers(what, header, lines[at + 1 :], series),
        gain=unit.si_per_count,
        quantity=quantity,
        sensor=", ".join(part for part in sensor if part),
    )


@dataclass(frozen=True, slots=True)
class Header:
    """Header of a series."""

    name: str
    lines: Sequence[str]
    unknown: float
    """Value that marks an unknown real or sample."""
    integers: Mapping[int, float]
    """Known entries by number."""
    reals: Mapping[int, float]
    """Known entries by number."""

    def integer(self, number: int, meaning: str) -> int:
        """A required integer."""
        if number not in self.integers:
            raise FormatError(f"{self.name} has no {meaning} (integer {number} of its header), which is needed")
        return int(self.integers[number])

    def real(self, number: int, meaning: str) -> float:
        """A required real."""
        if number not in self.reals:
            raise FormatError(f"{self.name} has no {meaning} (real {number} of its header), which is needed")
        return self.reals[number]


def header_of(name: str, lines: Sequence[str]) -> Header:
    """The header in the lines above a series.

    Raises:
        FormatError: a table is missing or damaged, or the mark of unknown values is not stated.
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
    """Known entries by number."""
    pattern = re.compile(TABLE % kind, re.IGNORECASE)
    at, table = first_match(name, lines, pattern, f"100 {kind}-header values follow on ... lines, Format= (...)")
    rows = lines[at + 1 : at + 1 + int(table["rows"])]
    what = f"the table of {kind.lower()}s of {name}"
    values = numbers_in_columns(what, rows, int(table["count"]), int(table["columns"] or 1), int(table["width"]))
    return {
        number: float(value) for number, value in enumerate(values, start=1) if value != unknown and isfinite(value)
    }


def _sensor(text: str) -> tuple[str, str]:
    """Orientation and location from the line of a channel, beside its number on the recorder."""
    orientation, _, location = text.partition("Location:")
    return RECORDER.sub("", orientation.strip()).strip(), location.strip()


def _parameter(header: Header) -> tuple[Quantity, str]:
    stage, parameter = header.integer(1, "stage of processing"), header.integer(2, "physical parameter")
    if stage != CORRECTED or parameter not in PARAMETERS:
        raise FormatError(
            f"{header.name} holds physical parameter {parameter} in stage of processing {stage}; acceleration (1), "
            f"velocity (2), displacement (3) or relative displacement (4) is needed, corrected (2)"
        )
    return PARAMETERS[parameter]


def _channel(header: Header) -> str:
    """Network, station and channel, `CE.58658.07`; `NP.1795.01HNE` where the channel has a location and no number."""
    _, station = first_match(header.name, header.lines, STATION, "Code: network-station")
    if CHANNEL in header.integers:
        return f"{station[1]}.{station[2]}.{header.integer(CHANNEL, 'channel'):02d}"
    _, codes = first_match(header.name, header.lines, CODES, "number of the channel, or comment <SCNL> with its code,")
    return f"{station[1]}.{station[2]}.{codes[2].strip('-')}{codes[1]}"


def _unit(what: str, header: Header, quantity: Quantity, series: re.Match[str]) -> Gain:
    """The unit that the line above the series names; all codes in the header must agree with it."""
    try:
        unit = unit_gain(series["unit"])
    except FormatError as error:
        raise FormatError(f"{what}: {error}") from None
    coded = {int(code) for code in (series["code"], header.integers.get(3)) if code is not None}
    if unit.quantity != quantity or any(code not in UNITS or unit_gain(UNITS[code]) != unit for code in coded):
        raise FormatError(
            f"{what} is one of {quantity}, its unit {series['unit']!r}, and its units' codes {sorted(coded)}; "
            f"use a file that agrees with itself"
        )
    return unit


def _start(header: Header) -> datetime:
    """UTC, from the tables with their precise seconds; the text must state UTC and the same hour and minute."""
    day = (header.integer(YEAR, "start year"), header.integer(MONTH, "start month"), header.integer(DAY, "start day"))
    time = (header.integer(HOUR, "start hour"), header.integer(MINUTE, "start minute"))
    _, text = first_match(header.name, header.lines, START, "Rcrd start time: date, hour:minute:second UTC")
    try:
        start = datetime(*day, *time, tzinfo=UTC) + timedelta(seconds=header.real(SECOND, "start second"))
    except (ValueError, OverflowError):
        raise FormatError(f"the start of {header.name}, {day} {time}, is not a date and time") from None
    if (int(text[1]), int(text[2])) != time:
        raise FormatError(f"{header.name} starts at {time} by its integers, and at {text[1]}:{text[2]} by its text")
    return start


def _numbers(what: str, header: Header, rows: Sequence[str], series: re.Match[str]) -> Vector:
    """(n,) in the file's units, as many as count, length and interval of the header say; NaN where not known."""
    count, columns = int(series["count"]), int(series["columns"] or 1)
    if len(rows) != -(-count // columns):
        raise FormatError(f"{what} has {len(rows)} lines of {columns} numbers; {count} numbers are needed")
    numbers = numbers_in_columns(what, rows, count, columns, int(series["width"]))
    interval = header.real(INTERVAL, "interval between samples") / 1000
    length = header.reals.get(LENGTH, count * interval)
    if abs(length - count * interval) > 1.5 * interval:  # some count the samples, some the intervals between them
        raise FormatError(f"{what} has {count} samples at {interval} s, but lasts {length} s; one of them is wrong")
    known, peak = numbers != header.unknown, header.reals.get(PEAK)
    check_peak(what, numbers[known], peak, max(PRINTED, _last_digit(series, peak or 0.0)))
    return np.where(known, numbers, np.nan)


def _last_digit(series: re.Match[str], value: float) -> float:
    """Largest value of the last printed digit, in the file's units."""
    digit = 10.0 ** -int(series["decimals"] or 0)
    return digit if series["kind"].upper() in "FI" else 10 * abs(value) * digit
