"""Records in CSMIP volume 2 files: corrected acceleration, velocity and displacement of one or more channels.

Format: Shakal & Huang (1985), Standard Tape Format for CSMIP Strong-Motion Data Tapes, CSMIP report OSMS 85-03: text
header of 25 lines, 100 integers, 100 reals, then three series, each after a line that states its count and format.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime

import numpy as np

from core.arrays import Vector
from service.formats.errors import FormatError
from service.formats.trace import Contents, Trace
from service.formats.units import Gain, unit_gain

FIRST = re.compile(rb"corrected accelerogram", re.IGNORECASE)
START = re.compile(r"Start time:\s*(\d+/\s*\d+/\d+,\s*\d+:\s*\d+:\s*[\d.]+)\s*(UTC|GMT)", re.IGNORECASE)
STATION = re.compile(r"Station No\.\s*(\S+)")
CHANNEL = re.compile(r"^Chan\s+(\d+):\s*(.*?)\s*(?:Location:\s*(.*))?$")
PEAK = re.compile(r"Peak\s+(acceleration|velocity|displacement)\s*=\s*(-?[\d.]+)", re.IGNORECASE)
SERIES = re.compile(
    r"\s*(\d+) points of (accel|veloc|displ) data equally spaced at\s+([\d.]+)\s*sec,"
    r" in (cm/sec2|cm/sec|cm)\.?\s*\((\d+)f(\d+)\.(\d+)\)",
    re.IGNORECASE,
)
END = re.compile(r"/&\s*-*\s*End of data for channel")
CODES = {"acceleration": "ACC", "velocity": "VEL", "displacement": "DIS"}
PRINTED = 0.001
"""cm, s: the last digit of the header's peaks."""


def is_csmip(data: bytes) -> bool:
    """Whether these bytes begin as a CSMIP volume 2 file does."""
    return FIRST.match(data) is not None


def read_csmip(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """All channels of a file; ids are `CE.<station>.<channel number>.<ACC|VEL|DIS>`."""
    lines = data.decode("ascii", errors="replace").splitlines()
    ends = [number for number, line in enumerate(lines) if END.match(line)]
    if not ends:
        raise FormatError(f"{name} is truncated: no line says 'End of data for channel'; fetch it again")
    starts = [0, *(end + 1 for end in ends[:-1])]
    traces = (trace for start, end in zip(starts, ends, strict=True) for trace in _channel(name, lines[start:end]))
    return Contents("waveforms", tuple(traces))


def _channel(name: str, lines: Sequence[str]) -> Iterator[Trace]:
    """The series of one channel, each checked against the peak that the header prints."""
    header = [line.rstrip() for line in lines[:25]]
    station, start = _match(name, header, STATION, "Station No.")[1], _start(name, header)
    number, orientation, location = _match(name, header, CHANNEL, "Chan").groups(default="")
    peaks = {peak[1].lower(): abs(float(peak[2])) for line in header if (peak := PEAK.match(line))}
    for at, line in enumerate(lines):
        if not (series := SERIES.match(line)):
            continue
        unit = unit_gain(series[4])
        numbers = _numbers(f"{series[2]} of channel {number} in {name}", lines[at + 1 :], series)
        _check_peak(f"{series[2]} of channel {number} in {name}", numbers, peaks.get(unit.quantity))
        yield Trace(
            channel=f"CE.{station}.{int(number):02d}.{CODES[unit.quantity]}",
            start=start,
            rate=1 / float(series[3]),
            numbers=numbers,
            gain=unit.si_per_count,
            quantity=unit.quantity,
            sensor=", ".join(part for part in (orientation, location) if part),
        )


def _match(name: str, header: Sequence[str], pattern: re.Pattern[str], label: str) -> re.Match[str]:
    for line in header:
        if found := pattern.search(line):
            return found
    raise FormatError(f"the header of {name} has no {label!r}; a CSMIP volume 2 file with it would do")


def _start(name: str, header: Sequence[str]) -> datetime:
    text = _match(name, header, START, "Start time: month/day/year, hour:minute:second UTC")[1]
    try:
        return datetime.strptime(text.replace(" ", ""), "%m/%d/%y,%H:%M:%S.%f").replace(tzinfo=UTC)
    except ValueError:
        raise FormatError(f"the start time of {name} is {text!r}; month/day/year, h:m:s.s in UTC would do") from None


def _numbers(what: str, lines: Sequence[str], series: re.Match[str]) -> Vector:
    """(n,) cm, s: numbers in columns of fixed width, which may touch."""
    count, columns, width = int(series[1]), int(series[5]), int(series[6])
    rows = lines[: -(-count // columns)]
    text = "".join(row.ljust(columns * width)[: columns * width] for row in rows)
    fields = np.frombuffer(text.encode("ascii", errors="replace"), dtype=f"S{width}")[:count]
    try:
        return fields.astype(np.float64)
    except ValueError:
        raise FormatError(f"{what} is truncated or damaged: {count} numbers of {width} columns would do") from None


def _check_peak(what: str, numbers: Vector, printed: float | None) -> None:
    found = float(np.abs(numbers).max()) if numbers.size else 0.0
    if printed is not None and abs(found - printed) > PRINTED:
        raise FormatError(f"{what} is damaged: its peak is {found:.3f}, its header prints {printed:.3f} (cm, s)")
