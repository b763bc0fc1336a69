"""Files written here after the published layout, as no archive of such files is at hand.

Layout: COSMOS Strong Motion Programs Board (2001), COSMOS Strong Motion Data Format, version 1.20.
"""

import re
from collections.abc import Callable
from datetime import UTC, datetime
from io import BytesIO
from zipfile import ZipFile

import numpy as np
import pytest
from hypothesis import given, strategies as st
from volumes import KINDS, record, wave

from service.formats import FormatError, Trace, UnknownFormatError, read


def traces(text: str) -> tuple[Trace, ...]:
    return read("CE58658.V2C", text.encode(), {}).traces


def replaced(pattern: str, replacement: str) -> Callable[[str], str]:
    def change(text: str) -> str:
        changed, times = re.subn(pattern, replacement, text, count=1)
        assert times == 1
        return changed

    return change


def entry(kind: str, columns: int, width: int, number: int, value: str) -> Callable[[str], str]:
    """Another value for an entry of a table."""

    def change(text: str) -> str:
        lines = text.split("\n")
        heading = next(at for at, line in enumerate(lines) if f"{kind}-header" in line)
        row, column = divmod(number - 1, columns)
        line = lines[heading + 1 + row]
        lines[heading + 1 + row] = line[: column * width] + value.rjust(width) + line[(column + 1) * width :]
        return "\n".join(lines)

    return change


def integer(number: int, value: int) -> Callable[[str], str]:
    return entry("Integer", 10, 8, number, str(value))


def real(number: int, value: float) -> Callable[[str], str]:
    return entry("Real", 6, 13, number, f"{value:.6f}")


def test_a_record_in_si() -> None:
    (trace,) = traces(record())
    assert trace.channel == "CE.58658.07.ACC"
    assert trace.quantity == "acceleration"
    assert trace.start == datetime(2018, 1, 4, 10, 39, 22, 250000, tzinfo=UTC)
    assert trace.rate == 200.0
    assert trace.sensor == "340 deg, Roof, north"
    np.testing.assert_array_equal(trace.numbers, wave(20))
    np.testing.assert_allclose(trace.to_si(), wave(20) / 100, rtol=1e-15)  # one rounding


def test_several_channels_of_three_series_each_in_one_file() -> None:
    text = "".join(record(kind, channel) for channel in (7, 12) for kind in KINDS)
    found = traces(text)
    assert [trace.channel for trace in found] == [
        f"CE.58658.{channel}.{code}" for channel in ("07", "12") for code in ("ACC", "VEL", "DIS")
    ]
    assert [trace.quantity for trace in found] == [*KINDS, *KINDS]
    assert {trace.gain for trace in found} == {0.01}


@pytest.mark.parametrize(
    ("layout", "digit"), [("8F10.5", 0.0), ("1E15.6", 5e-6), ("6F13.9", 0.0), ("8F10.3", 5e-4), ("6E12.3", 5e-3)]
)
def test_numbers_follow_the_declared_format(layout: str, digit: float) -> None:
    """Equal to half of the last digit that the format prints of numbers below 100."""
    (trace,) = traces(record(layout=layout))
    np.testing.assert_allclose(trace.numbers, wave(20), rtol=0, atol=digit * 1.001)


@given(st.integers(1, 40))
def test_every_count_is_read_whole(count: int) -> None:
    (trace,) = traces(record(count=count))
    np.testing.assert_array_equal(trace.numbers, wave(count))


def test_numbers_that_touch_are_distinguished_by_their_columns() -> None:
    touching = replaced(r"(?s)(\(8F10.5\)\n).*(End-of)", r"\1" + "-99.876543" * 8 + r"\n\2")
    text = real(64, -99.876543)(real(63, 0.04)(touching(record().replace("20 acc", " 8 acc"))))
    assert traces(text)[0].numbers.tolist() == [-99.876543] * 8


def test_a_relative_displacement_has_its_own_name() -> None:
    (trace,) = traces(integer(2, 4)(record("displacement")))
    assert (trace.channel, trace.quantity) == ("CE.58658.07.REL", "displacement")


@pytest.mark.parametrize(
    ("comment", "channel"), [("1795.HNE.NP.01", "NP.1795.01HNE.ACC"), ("1795.HNE.NP.--", "NP.1795.HNE.ACC")]
)
def test_a_channel_without_a_number_has_its_code(comment: str, channel: str) -> None:
    text = integer(50, -999)(record()).replace(
        "|<PROCESS> MANUAL", f"|<SCNL>{comment}    <AUTH> 2019/02/01 21:38:15.000"
    )
    text = text.replace("Sta Chan  7: 340 deg", "Sta Chan   ?:340 deg").replace("Code:CE-58658", "Code:NP-1795")
    assert [(trace.channel, trace.sensor) for trace in traces(text)] == [(channel, "340 deg, Roof, north")]


@pytest.mark.parametrize(("code", "unit", "gain"), [(2, "g", 9.80665), (10, "gal", 0.01), (4, "cm/s^2", 0.01)])
def test_units_by_name_and_code(code: int, unit: str, gain: float) -> None:
    (trace,) = traces(integer(3, code)(record()).replace("cm/sec2(04)", f"{unit} ({code})"))
    assert trace.gain == gain


def test_a_unit_by_name_alone() -> None:
    (trace,) = traces(integer(3, -999)(record()).replace("cm/sec2(04)", "cm/s^2"))
    assert trace.gain == 0.01


def test_a_length_that_counts_the_intervals() -> None:
    (trace,) = traces(real(63, 19 * 0.005)(record()))
    assert trace.numbers.size == 20


def test_an_unknown_peak_is_not_compared() -> None:
    (trace,) = traces(real(64, -999.0)(record()))
    assert trace.numbers.size == 20


def test_files_of_a_zip_archive_and_their_companions() -> None:
    buffer = BytesIO()
    with ZipFile(buffer, "w") as archive:
        archive.writestr("a.acc.V2c", record())
        archive.writestr("a.dis.V2c", record("displacement"))
        archive.writestr("a.V0c", record().replace("Corrected acceleration ", "Raw acceleration counts"))
        archive.writestr("a.V1c", record().replace("Corrected", "Uncorrected"))
        archive.writestr("a.V3c", record().replace("Corrected acceleration", "Response spectra"))
    contents = read("CE58658.zip", buffer.getvalue(), {})
    assert [trace.channel for trace in contents.traces] == ["CE.58658.07.ACC", "CE.58658.07.DIS"]
    assert len(contents.remarks) == 3


def test_uncorrected_records_are_refused() -> None:
    with pytest.raises(UnknownFormatError, match=r"begins with b'Uncorrected acceleration.*COSMOS V2.*"):
        traces(record().replace("Corrected", "Uncorrected"))


WRONG = {
    "no end": (replaced(r"End-of-data.*\n", ""), "truncated: no line says 'End of data"),
    "a second record without end": (lambda text: text + text[: len(text) // 2], "truncated: no line says 'End of data"),
    "a row lost": (replaced(r"(\(8F10.5\)\n).*\n", r"\1"), "CE.58658.07.ACC in CE58658.V2C has 2 lines of 8 numbers"),
    "a row cut": (replaced(r".{12}\nEnd", r"\nEnd"), "CE.58658.07.ACC in CE58658.V2C is truncated or damaged"),
    "too many rows": (replaced("End-of", "   1.00000\nEnd-of"), "has 4 lines of 8 numbers; 20 numbers are needed"),
    "another count": (replaced("20 acc", "24 acc"), "truncated or damaged: 24 numbers"),
    "another interval": (real(62, 20.0), "has 20 samples at 0.02 s, but lasts 0.1 s"),
    "another length": (real(63, 0.2), "has 20 samples at 0.005 s, but lasts 0.2 s"),
    "no interval": (real(62, -999.0), "no interval between samples (real 62"),
    "an interval of nothing": (
        real(62, 0.0),
        "the interval between samples of CE.58658.07.ACC in CE58658.V2C is 0.0 s",
    ),
    "another peak": (real(64, 91.0), "is damaged: its peak is"),
    "stars": (replaced(r"(\(8F10.5\)\n).{10}", r"\1**********"), "truncated or damaged"),
    "unknown samples": (
        replaced(r".{10}\nEnd", "-999.00000\nEnd"),
        "1 of 20 samples of CE.58658.07.ACC are not numbers",
    ),
    "a unit of another quantity": (replaced(r"cm/sec2\(04\)", "cm(06)"), "is one of acceleration, its unit 'cm'"),
    "a unit and a code that differ": (replaced(r"cm/sec2\(04\)", "cm/sec2(02)"), "its units' codes [2, 4]"),
    "a table of another unit": (integer(3, 2), "its units' codes [2, 4]"),
    "another parameter": (integer(2, 2), "is one of velocity, its unit 'cm/sec2'"),
    "counts": (replaced(r"cm/sec2\(04\)", "counts (50)"), "ACC in CE58658.V2C: unit 'counts' is not known"),
    "no unit": (replaced(r"cm/sec2\(04\)", ""), "the unit is missing"),
    "pressure": (integer(2, 20), "physical parameter 20 in stage of processing 2"),
    "raw": (integer(1, 0), "stage of processing 0"),
    "no year": (integer(40, -999), "no start year (integer 40"),
    "no hour": (integer(44, -999), "no start hour (integer 44"),
    "no second": (real(30, -999.0), "no start second (real 30"),
    "no such month": (integer(42, 13), "(2018, 13, 4) (10, 39), is not a date and time"),
    "no start in text": (replaced("Rcrd start time", "Rcrd"), "no 'Rcrd start time"),
    "local time": (replaced("22.250 UTC", "22.250 PST"), "no 'Rcrd start time"),
    "two starts": (integer(44, 2), "starts at (2, 39) by its integers, and at 10:39 by its text"),
    "no station": (replaced("Code:CE-58658", ""), "no 'Code: network-station'"),
    "no channel": (integer(50, -999), "no 'number of the channel"),
    "version 1.00": (replaced(r"v01\.20", "v01.00"), "version 01.00 of the COSMOS format"),
    "no integers": (replaced("100 Integer", "Integer"), "no '100 Integer-header values"),
    "too few integers": (replaced("100 Integer", "110 Integer"), "the table of integers of CE58658.V2C is truncated"),
    "damaged reals": (replaced(r"-999\.000000", "-999.0000x0"), "the table of reals of CE58658.V2C is truncated"),
    "no series": (replaced("pts", "points"), "no '... acceleration pts"),
    "nothing for the unknown": (replaced("unknown/unspecified", "unknown"), "no 'Values used when"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_damaged_file_is_refused(kind: str) -> None:
    damage, message = WRONG[kind]
    with pytest.raises(FormatError, match=re.escape(message)):
        traces(damage(record()))


@pytest.mark.parametrize("lost", range(record().count("\n")))
def test_a_line_lost_anywhere_is_refused_or_changes_nothing(lost: int) -> None:
    lines = record().split("\n")
    (whole,) = traces("\n".join(lines))
    try:
        (trace,) = traces("\n".join(lines[:lost] + lines[lost + 1 :]))
    except FormatError:
        return
    assert (trace.channel, trace.start, trace.rate, trace.gain) == (whole.channel, whole.start, whole.rate, whole.gain)
    np.testing.assert_array_equal(trace.numbers, whole.numbers)


@given(st.integers(0, len(record()) - 1), st.characters(max_codepoint=255))
def test_any_character_anywhere_is_read_or_refused(place: int, character: str) -> None:
    text = record()
    try:
        (trace,) = traces(text[:place] + character + text[place + 1 :])
    except FormatError:
        return
    assert trace.numbers.size == 20
