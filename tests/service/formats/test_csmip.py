import re
from collections.abc import Callable
from datetime import UTC, datetime
from zipfile import ZipFile

import numpy as np
import pytest
from shared_data import CSMIP, needs_shared
from volumes import volume

from service.formats import FormatError, Trace, read


def traces(text: str) -> tuple[Trace, ...]:
    return read("CHAN007.V2", text.encode(), {}).traces


def test_three_series_of_a_channel_in_si() -> None:
    acceleration, velocity, displacement = traces(volume())
    assert acceleration.channel == "CE.58658.07.ACC"
    assert [trace.quantity for trace in (acceleration, velocity, displacement)] == [
        "acceleration",
        "velocity",
        "displacement",
    ]
    assert {trace.gain for trace in (acceleration, velocity, displacement)} == {0.01}
    assert acceleration.start == datetime(2018, 1, 4, 10, 39, 22, tzinfo=UTC)
    assert acceleration.rate == 200.0
    assert acceleration.sensor == "Long, Abutment 1"
    assert acceleration.numbers.size == 20
    assert acceleration.to_si()[0] == pytest.approx(np.random.default_rng(3).uniform(-9, 9, 20)[0] / 100, abs=5e-9)


def test_numbers_that_touch_are_distinguished_by_their_columns() -> None:
    text = (
        volume()
        .replace("in cm/sec2. (8f10.6)", "in cm/sec2. (8f10.6)\n" + "-12.345678" * 8, 1)
        .replace("20 points of a", "8 points of a")
    )
    (acceleration, *_) = traces(re.sub(r"Peak acceleration = +[\d.]+", "Peak acceleration = 12.346", text))
    assert acceleration.numbers.tolist() == [-12.345678] * 8


def test_two_channels_in_one_file() -> None:
    second = volume().replace("Chan  7", "Chan 12")
    assert [trace.channel for trace in traces(volume() + second)][::3] == ["CE.58658.07.ACC", "CE.58658.12.ACC"]


def test_a_channels_number_is_the_stations_not_the_recorders() -> None:
    (trace, *_) = traces(volume().replace("Long  ", "Long    (Sta Chn: 25)"))
    assert (trace.channel, trace.sensor) == ("CE.58658.25.ACC", "Long, Abutment 1")


def test_times_of_older_files_are_californias() -> None:
    (trace, *_) = traces(volume(start="5/02/83, 16:42:48.2 PDT"))
    assert trace.start == datetime(1983, 5, 2, 23, 42, 48, 200000, tzinfo=UTC)


def without_a_row(text: str) -> str:
    lines = text.split("\n")
    return "\n".join(lines[:46] + lines[47:])


def replaced(pattern: str, replacement: str) -> Callable[[str], str]:
    return lambda text: re.sub(pattern, replacement, text, count=1)


WRONG = {
    "no end": (replaced(r"/&(.|\n)*", ""), "truncated: no line says 'End of data"),
    "a second channel without end": (
        lambda text: text + text[: len(text) // 2],
        "truncated: no line says 'End of data",
    ),
    "an interval of nothing": (replaced(r"at  \.005", "at  .000"), "is .000 s; it must be above 0"),
    "a row lost": (without_a_row, "accel of channel 7"),
    "no start": (replaced("Start time", "Time"), "no 'Start time"),
    "odd start": (replaced("1/04/18", "31/31/18"), "the start of CHAN007.V2 is '31/31/18"),
    "no station": (replaced(r"Station No\.", "Stn"), "no 'Station No.'"),
    "no series": (lambda text: text.replace("points of", "point of"), "no line 'points of accel data"),
    "another peak": (replaced(r"(Peak acceleration =) +[\d.]+", r"\1 1.000"), "is damaged: its peak is"),
    "stars": (replaced(r"\(8f10.6\)\n {2}", "(8f10.6)\n**"), "truncated or damaged"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_damaged_file_is_refused(kind: str) -> None:
    damage, message = WRONG[kind]
    with pytest.raises(FormatError, match=re.escape(message)):
        traces(damage(volume()))


@needs_shared
def test_the_real_archive_whole() -> None:
    """Every peak that the 20 headers print, to half of its last digit, and the line that counts the samples."""
    (archive,) = CSMIP.glob("*.zip")
    contents = read(archive.name, archive.read_bytes(), {})
    found = {trace.channel: trace for trace in contents.traces}
    assert len(found) == 60
    assert len(contents.remarks) == 20  # the response spectra, CHAN*.V3
    with ZipFile(archive) as files:
        for member in (name for name in files.namelist() if name.endswith(".V2")):
            header = files.read(member).decode("ascii")[:2500]
            number = int(member[4:7])
            for code, label in {"ACC": "acceleration", "VEL": r"  velocity  ", "DIS": "displacement"}.items():
                printed = re.search(rf"Peak {label} =\s+(-?[\d.]+).* at\s+([\d.]+)", header)
                assert printed is not None
                trace = found[f"CE.58658.{number:02d}.{code}"]
                peak = int(np.argmax(np.abs(trace.numbers)))
                assert trace.numbers.size == 12600
                assert trace.numbers[peak] == pytest.approx(float(printed[1]), abs=5.1e-4)
                assert peak / trace.rate == pytest.approx(float(printed[2]), abs=5.1e-3)  # one sample
    assert found["CE.58658.01.ACC"].sensor == "Up, Abutment 1"
    assert {trace.start for trace in found.values()} == {datetime(2018, 1, 4, 10, 39, 22, tzinfo=UTC)}
