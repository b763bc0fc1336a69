"""Hostile text costs little time and memory: patterns do not backtrack, and lines, files and archives have bounds."""

import tracemalloc
from io import BytesIO
from time import process_time
from zipfile import ZIP_DEFLATED, ZipFile

import pytest

from service.formats import FormatError, cosmos, csmip, csv_table, read, volume2
from service.records.sources.fdsnws import WRITTEN

COSMOS = "Corrected acceleration (Format v01.20 with 13 text lines)\n"
CSMIP = "Corrected accelerogram\n"
SECONDS = 2.0
"""s of processor time; the fastest pattern with backtracking took longer on the same text."""
TRAPS = {
    "series": COSMOS + ("1 " + "a pts," * 70 + "units=" * 70 + " " * 150 + "\n") * 900,
    "series of spaces": COSMOS + ("1 a pts,units=" + " " * 900 + "\n") * 900,
    "layouts": COSMOS + ("1 a pts," + "units=," * 20 + "Format" + " " * 800 + "\n") * 900,
    "one long line": COSMOS + "1 " + "a pts," * 1000 + "units=" * 1000 + " " * 1000,
    "ends": CSMIP + ("/&" + " " * 1000 + "\n") * 3000,
    "rows": CSMIP + "x\n" * 30 + "9 points of accel data equally spaced at .01 sec, in g (99f99.1)\n" + "\n" * 100_000,
}
LINES = {
    "start": (cosmos.START, "start time:" * 45 + "1:" * 250),
    "sensor": (cosmos.SENSOR, "Sta Cha" + "1" * 1000),
    "spaces": (cosmos.SENSOR, "Sta Cha1:" + " (Rcrdr Chan" * 40 + " " * 500 + "L"),
    "channel": (csmip.CHANNEL, "Chan 1:" + " (Sta Chn:" * 50 + " " * 500 + "L"),
}


@pytest.mark.parametrize("trap", TRAPS)
def test_text_that_was_made_to_trap_a_reader_is_refused_at_once(trap: str) -> None:
    ends = "\nEnd-of-data for\n" if TRAPS[trap].startswith(COSMOS) else "\n/& End of data for channel\n"
    began = process_time()
    with pytest.raises(FormatError):
        read("trap.v2", (TRAPS[trap] + ends).encode(), {})
    assert process_time() - began < SECONDS


@pytest.mark.parametrize("kind", LINES)
def test_lines_that_were_made_to_trap_a_pattern_cost_little(kind: str) -> None:
    pattern, line = LINES[kind]
    began = process_time()
    for _ in range(1000):
        pattern.search(line)
    assert process_time() - began < SECONDS


def test_a_column_that_was_made_to_trap_the_reader_is_refused_at_once() -> None:
    began = process_time()
    with pytest.raises(FormatError, match="is not a channel with its unit"):
        read("trap.csv", b"# start: 2024-01-01T00:00:00Z\n# rate: 100\n" + b"[" * 50_000, {})
    assert process_time() - began < SECONDS


def test_stations_without_an_end_do_not_trap_their_comparison() -> None:
    began = process_time()
    WRITTEN.sub(b"", b"<Created>" * 200_000)
    assert process_time() - began < SECONDS
    assert WRITTEN.sub(b"", b"<a/><Created>2024-01-01T00:00:00</Created>") == b"<a/>"


def test_a_line_that_no_format_has_is_refused() -> None:
    with pytest.raises(FormatError, match=r"line 2 of a.v2 has 5000 characters, at most 1024 are accepted"):
        read("a.v2", (COSMOS + "x" * 5000).encode(), {})
    with pytest.raises(FormatError, match=r"a.csv has a line of 200000 characters"):
        read("a.csv", b"# start\n" + b"1" * 200_000, {})


def test_too_many_lines_or_columns_are_refused() -> None:
    with pytest.raises(FormatError, match=f"lines, at most {volume2.MOST_LINES} are accepted; send shorter files"):
        read("a.csv", b"#\n" + b"\n" * (2 * volume2.MOST_LINES + 1), {})
    heading = b"# start: 2024-01-01T00:00:00Z\n# rate: 100\n"
    with pytest.raises(FormatError, match=f"has 1001 columns, at most {csv_table.MOST_COLUMNS} are accepted"):
        read("a.csv", heading + b",".join([b"A [g]"] * 1001), {})


def test_a_small_archive_does_not_become_a_large_table() -> None:
    """An archive of 0.1 MiB: at most 32 MiB come of it, and not ten times that of memory."""
    table = b"# start: 2024-01-01T00:00:00Z\n# rate: 100\nA [g]\n" + b"0\n" * 30 * 2**20
    buffer = BytesIO()
    with ZipFile(buffer, "w", ZIP_DEFLATED) as made:
        made.writestr("a.csv", table)
    assert len(buffer.getvalue()) < 2**17
    tracemalloc.start()
    with pytest.raises(
        FormatError, match="unpacks to more than 33554432; use smaller archives, or ones packed at most 100"
    ):
        read("bomb.zip", buffer.getvalue(), {})
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 150 * 2**20


def test_a_long_table_is_read_in_pieces() -> None:
    count = 3 * csv_table.AT_ONCE // 2
    rows = "".join(f"{n},{-n}\n" for n in range(count))
    data = f"# start: 2024-01-01T00:00:00Z\n# rate: 100\nA [g],B [g]\n{rows}".encode()
    first, second = read("a.csv", data, {}).traces
    assert first.numbers.tolist() == list(range(count))
    assert (second.numbers == -first.numbers).all()
