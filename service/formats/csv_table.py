"""Records in CSV files with a header that says everything; docs/operate/csv.md describes it.

# start: 2024-01-01T00:00:00Z
# rate: 100
XX.TOWER.00.HNX [gal], XX.TOWER.01.HNX [gal]
0.012, -0.003
"""

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

import numpy as np

from core.arrays import Matrix
from service.formats.format_errors import FormatError
from service.formats.trace import Contents, Trace
from service.formats.units import Gain, unit_gain
from service.formats.volume2 import text_lines

KEYS = ("start", "rate")
COLUMN = re.compile(r"(\S+)\s*\[([^\]]*)\]")
LONGEST_COLUMN = 200
"""Characters of a column's name and unit."""
LONGEST_LINE = 100_000
"""Characters."""
MOST_COLUMNS = 1000
"""Most columns of a table. Not tuned."""
AT_ONCE = 2**17
"""Numbers that are read together."""


def is_csv(data: bytes) -> bool:
    """True if these bytes begin with the header of such a file."""
    return data.removeprefix(b"\xef\xbb\xbf").startswith(b"#")


def read_csv(name: str, data: bytes, gains: Mapping[str, Gain]) -> Contents:
    """The record of a CSV file, whose header states start, rate, channels and units."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FormatError(f"{name} is not UTF-8 text: {error}; save it as UTF-8") from None
    lines = [line for line in text_lines(name, text) if line.strip()]
    if (longest := max(map(len, lines), default=0)) > LONGEST_LINE:
        raise FormatError(f"{name} has a line of {longest} characters, at most {LONGEST_LINE} are accepted")
    heading = [line for line in lines if line.startswith("#")]
    start, rate = _start_and_rate(name, heading)
    names, *rows = lines[len(heading) :] or [""]
    if (count := names.count(",") + 1) > MOST_COLUMNS:
        raise FormatError(f"{name} has {count} columns, at most {MOST_COLUMNS} are accepted")
    columns = [_column(name, cell) for cell in names.split(",")]
    samples = _samples(name, len(heading) + 2, len(columns), rows)
    traces = (
        Trace(channel, start, rate, numbers, gain.si_per_count, gain.quantity)
        for (channel, gain), numbers in zip(columns, samples, strict=True)
    )
    return Contents("waveforms", tuple(traces))


def _start_and_rate(name: str, heading: Sequence[str]) -> tuple[datetime, float]:
    pairs = [line.removeprefix("#").partition(":") for line in heading]
    values = {key.strip().lower(): value.strip() for key, _, value in pairs}
    for key in KEYS:
        if key not in values:
            raise FormatError(f"{name} has no line '# {key}: ...' at its top; docs/operate/csv.md shows one")
    try:
        start = datetime.fromisoformat(values["start"])
    except ValueError:
        raise FormatError(f"the start of {name} is {values['start']!r}; write 2024-01-01T00:00:00Z") from None
    if start.tzinfo is None:
        raise FormatError(f"the start {values['start']!r} of {name} has no offset; a Z at its end means UTC")
    try:
        return start.astimezone(UTC), float(values["rate"])
    except ValueError:
        raise FormatError(f"the rate of {name} is {values['rate']!r}; write a number of Hz") from None


def _column(name: str, cell: str) -> tuple[str, Gain]:
    match = COLUMN.fullmatch(cell.strip()) if len(cell) <= LONGEST_COLUMN else None
    if not match:
        raise FormatError(
            f"column {cell.strip()[:LONGEST_COLUMN]!r} of {name} is not a channel with its unit; write "
            f"XX.TOWER.01.HNX [gal]"
        )
    try:
        return match[1], unit_gain(match[2])
    except FormatError as error:
        raise FormatError(f"column {cell.strip()!r} of {name}: {error}") from None


def _samples(name: str, first: int, columns: int, rows: Sequence[str]) -> Matrix:
    """(columns, n) in the file's units."""
    if not rows:
        raise FormatError(f"{name} holds no samples below its header; leave it out")
    for number, row in enumerate(rows, start=first):
        if row.count(",") != columns - 1:
            raise FormatError(f"line {number} of {name} has {row.count(',') + 1} numbers; {columns} are needed")
    samples = np.empty((columns, len(rows)))
    together = max(1, AT_ONCE // columns)
    try:
        for at in range(0, len(rows), together):
            cells = np.array(",".join(rows[at : at + together]).split(","), dtype=np.float64)
            samples[:, at : at + together] = cells.reshape(-1, columns).T
    except ValueError as error:
        raise FormatError(f"{name} contains a value that is not a number: {str(error)[:LONGEST_COLUMN]}") from None
    return samples
