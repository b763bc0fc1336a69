import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from service.formats import FormatError, Trace, read

DOCUMENTATION = Path(__file__).resolve().parents[3] / "docs" / "operate" / "csv.md"
GOOD = """\
# start: 2024-01-01T21:00:00+09:00
# rate: 100
# note: whatever else is of interest
XX.TOWER.00.HNX [gal], XX.TOWER.01.HYX [mm], XX.TOWER.01.KO [degC]
1.5, -2, 20
0.5, 1e1, 20.5
"""


def traces(text: str) -> tuple[Trace, ...]:
    return read("a.csv", text.encode(), {}).traces


def test_a_table_in_si() -> None:
    acceleration, displacement, temperature = traces(GOOD)
    assert acceleration.channel == "XX.TOWER.00.HNX"
    assert acceleration.start == datetime(2024, 1, 1, 12, tzinfo=UTC)
    assert acceleration.start.utcoffset() == timedelta(0)
    assert acceleration.rate == 100.0
    assert acceleration.to_si() == pytest.approx([0.015, 0.005], rel=1e-15)
    assert displacement.to_si() == pytest.approx([-0.002, 0.01], rel=1e-15)
    assert temperature.to_si().tolist() == [20.0, 20.5]


def test_the_documented_example_is_right() -> None:
    (example,) = re.findall(r"```csv\n(.*?)```", DOCUMENTATION.read_text("utf-8"), re.DOTALL)
    assert [trace.quantity for trace in traces(example)] == ["acceleration", "acceleration", "displacement"]


@given(st.lists(st.tuples(*[st.floats(allow_nan=False, allow_infinity=False)] * 3), min_size=1, max_size=20))
def test_whatever_is_written_is_read(rows: list[tuple[float, float, float]]) -> None:
    written = GOOD.split("1.5")[0] + "\n".join(",".join(map(repr, row)) for row in rows) + "\n"
    assert np.array_equal([trace.numbers for trace in traces(written)], np.array(rows).T)


def test_a_spreadsheets_mark_and_line_ends_are_no_harm() -> None:
    assert len(read("a.csv", b"\xef\xbb\xbf" + GOOD.replace("\n", "\r\n").encode(), {}).traces) == 3


WRONG = {
    "no start": (r"# start.*\n", "", "no line '# start: ...'"),
    "no rate": (r"# rate.*\n", "", "no line '# rate: ...'"),
    "start without offset": (r"\+09:00", "", "has no offset"),
    "start in words": (r"2024-01-01T21:00:00", "noon", "the start of a.csv is 'noon"),
    "rate in words": ("100", "fast", "the rate of a.csv is 'fast'"),
    "rate of zero": ("100", "0", "sampling rate of XX.TOWER.00.HNX is 0.0 Hz"),
    "no unit": (r" \[gal\]", "", "column 'XX.TOWER.00.HNX' of a.csv is not a channel with its unit"),
    "empty unit": (r"\[gal\]", "[]", "the unit is missing"),
    "unknown unit": (r"\[gal\]", "[furlong]", "unit 'furlong' is not known"),
    "short row": (", 20.5", "", "line 6 of a.csv has 2 numbers; 3 are needed"),
    "word among numbers": ("20.5", "warm", "is not a number"),
    "empty cell": ("20.5", "", "is not a number"),
    "NaN": ("20.5", "nan", "1 of 2 samples of XX.TOWER.01.KO are not numbers"),
    "no samples": (r"1\.5(.|\n)*", "", "no samples below its header"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_table_is_refused(kind: str) -> None:
    pattern, replacement, message = WRONG[kind]
    with pytest.raises(FormatError, match=re.escape(message)):
        traces(re.sub(pattern, replacement, GOOD, count=1))


def test_another_encoding_is_refused() -> None:
    with pytest.raises(FormatError, match="is not UTF-8 text"):
        read("a.csv", GOOD.replace("whatever", "für").encode("latin-1"), {})
