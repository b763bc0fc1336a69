"""Records in CSMIP volume 2 files: corrected acceleration, velocity and displacement of one or more channels.

Format: Shakal & Huang (1985), Standard Tape Format for CSMIP Strong-Motion Data Tapes, CSMIP report OSMS 85-03: text
header of 25 lines, 100 integers, 100 reals, then three series, each after a line that states its count and format.
"""

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta, timezone

from service.formats.format_errors import FormatError
from service.formats.trace import Contents, Trace
from service.formats.units import Gain, unit_gain
from service.formats.volume2 import check_peak, first_match, numbers_in_columns, records, sampling_rate

FIRST = re.compile(rb"corrected accelerogram", re.IGNORECASE)
START = re.compile(
    r"(?:Start|Trigger) time:\s*(\d+/\s*\d+/\d+,\s*\d+:\s*\d+:\s*[\d.]+)\s*(UTC|GMT|PST|PDT)", re.IGNORECASE
)
ZONES = {"UTC": 0, "GMT": 0, "PST": -8, "PDT": -7}
"""h ahead of UTC; older files give California's time."""
HEADER_LINES = 25
"""Lines of the text header."""
STATION = re.compile(r"Station No\.\s*(\S+)", re.IGNORECASE)
CHANNEL = re.compile(r"^Chan\s+(\d{1,9}):(.*)", re.IGNORECASE)
LOCATION = re.compile(r"Location:", re.IGNORECASE)
AT_STATION = re.compile(r"\(Sta Chn:\s*(\d{1,9})\s*\)$", re.IGNORECASE)
"""A station of several recorders gives a channel its number on the recorder, and its number at the station."""
PEAK = re.compile(r"Peak\s+(acceleration|velocity|displacement)\s*=\s*(-?[\d.]+)", re.IGNORECASE)
SERIES = re.compile(
    r"\s*([1-9]\d{0,8}) points of (accel|veloc|displ) data equally spaced at\s+([\d.]+)\s*sec[,.]\s*"
    r"(?:in|\(units:) ([a-z/]+2?)[.)]?(?:\s*\(([1-9]\d?)f([1-9]\d?)\.\d+\))?",
    re.IGNORECASE,
)
END = re.compile(r"/&\s*+(?:-++\s*+)?End of data for channel")
COLUMNS, WIDTH = 8, 10
"""Defaults if the line before the numbers does not state them."""
CODES = {"acceleration": "ACC", "velocity": "VEL", "displacement": "DIS"}


def is_csmip(data: bytes) -> bool:
    """True if these bytes begin as a CSMIP volume 2 file does."""
    return FIRST.match(data) is not None


def read_csmip(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """All channels of a file; ids are `CE.<station>.<channel number>.<ACC|VEL|DIS>`."""
    traces = (trace for lines in records(name, data, END) for trace in _channel(name, lines))
    return Contents("waveforms", tuple(traces))


def _channel(name: str, lines: Sequence[str]) -> list[Trace]:
    """The series of one channel, each checked against the peak that the header prints."""
    header = [line.rstrip() for line in lines[:HEADER_LINES]]
    starts = [(at, series) for at, line in enumerate(lines) if (series := SERIES.match(line))]
    if not starts:
        raise FormatError(f"{name} has no line 'points of accel data equally spaced at ...', which corrected data have")
    return [_series(name, header, lines[at + 1 :], series) for at, series in starts]


def _series(name: str, header: Sequence[str], lines: Sequence[str], series: re.Match[str]) -> Trace:
    _, station = first_match(name, header, STATION, "Station No.")
    _, channel = first_match(name, header, CHANNEL, "Chan")
    number, orientation, location = _sensor(channel)
    what, unit = f"{series[2].lower()} of channel {number} in {name}", unit_gain(series[4])
    count, columns, width = int(series[1]), int(series[5] or COLUMNS), int(series[6] or WIDTH)
    numbers = numbers_in_columns(what, lines, count, columns, width)
    peaks = {peak[1].lower(): peak[2] for line in header if (peak := PEAK.match(line))}
    check_peak(what, numbers, _printed(what, peaks.get(unit.quantity)))
    return Trace(
        channel=f"CE.{station[1]}.{int(number):02d}.{CODES[unit.quantity]}",
        start=_start(name, header),
        rate=sampling_rate(what, series[3]),
        numbers=numbers,
        gain=unit.si_per_count,
        quantity=unit.quantity,
        sensor=", ".join(part for part in (orientation, location) if part),
    )


def _sensor(channel: re.Match[str]) -> tuple[str, str, str]:
    """The channel's number at the station, its orientation and its location."""
    orientation, *location = LOCATION.split(channel[2], maxsplit=1)
    orientation = orientation.strip()
    if at_station := AT_STATION.search(orientation):
        return at_station[1], orientation[: at_station.start()].strip(), "".join(location).lstrip()
    return channel[1], orientation, "".join(location).lstrip()


def _printed(what: str, peak: str | None) -> float | None:
    try:
        return None if peak is None else float(peak)
    except ValueError:
        raise FormatError(f"{what} is damaged: its header prints the peak {peak!r}, which is not a number") from None


def _start(name: str, header: Sequence[str]) -> datetime:
    _, match = first_match(name, header, START, "Start time: month/day/year, hour:minute:second UTC")
    zone = timezone(timedelta(hours=ZONES[match[2].upper()]))
    try:
        return datetime.strptime(match[1].replace(" ", ""), "%m/%d/%y,%H:%M:%S.%f").replace(tzinfo=zone).astimezone(UTC)
    except ValueError:
        raise FormatError(f"the start of {name} is {match[1]!r}; write month/day/year, hour:minute:second") from None
