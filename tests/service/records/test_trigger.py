"""Earthquakes are found in noise, in every rate, and nowhere else."""

import tracemalloc
from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from core.record import Segment
from service.formats import FormatError, Trace as Recorded
from service.records.trigger import TriggerSettings, check_gaps, windows

START = datetime(2024, 1, 1, tzinfo=UTC)
SETTINGS = TriggerSettings(
    short=1.0,
    long=30.0,
    on=4.0,
    off=1.5,
    channels=2,
    floor=0.005,
    before=timedelta(seconds=20),
    after=timedelta(seconds=30),
)


def record(
    shaking: Sequence[float], channels: int = 3, rate: float = 100.0, strength: float = 0.5, offset: float = 0.1
) -> list[Segment]:
    """Five minutes of noise of 1 mm/s² rms on an offset, with 10 s of shaking at the given times on all channels."""
    rng = np.random.default_rng(7)
    time = np.arange(round(300 * rate)) / rate
    segments = []
    for channel in range(channels):
        samples = offset + 1e-3 * rng.standard_normal(time.size)
        for start in shaking:
            within = (time >= start) & (time < start + 10)
            samples[within] += strength * np.sin(2 * np.pi * 3 * time[within])
        segments.append(Segment(f"XX.TOWER.0{channel}.HNX", START, rate, samples))
    return segments


@pytest.mark.parametrize("rate", [50.0, 100.0, 200.0])
def test_an_earthquake_with_its_memory(rate: float) -> None:
    (window,) = windows(record([120], rate=rate), SETTINGS)
    assert (window.start - START).total_seconds() == pytest.approx(100, abs=1)  # the short window's length
    assert 130 + 30 <= (window.end - START).total_seconds() < 200  # until the ratio has fallen, and the memory


def test_two_earthquakes_apart_and_two_that_touch() -> None:
    assert len(windows(record([60, 220]), SETTINGS)) == 2
    assert len(windows(record([100, 140]), SETTINGS)) == 1


def test_noise_is_none() -> None:
    assert windows(record([]), SETTINGS) == ()


def test_one_channel_alone_is_none() -> None:
    assert windows([*record([120], channels=1), *record([], channels=3)[1:]], SETTINGS) == ()
    assert len(windows(record([120], channels=1), SETTINGS)) == 1  # unless the building has no more


def test_shaking_below_the_floor_is_none() -> None:
    assert windows(record([120], strength=0.05), replace(SETTINGS, floor=0.2)) == ()


def test_pieces_that_meet_are_one() -> None:
    whole = record([148])
    pieces = [
        replace(segment, start=START + timedelta(seconds=first / 100), samples=segment.samples[first : first + 15_000])
        for segment in whole
        for first in (0, 15_000)
    ]
    assert windows(pieces, SETTINGS) == windows(whole, SETTINGS)


def without(segments: Sequence[Segment], start: float, end: float) -> list[Segment]:
    """The records with a gap, in s."""
    pieces = []
    for segment in segments:
        first, last = round(start * segment.rate), round(end * segment.rate)
        later = START + timedelta(seconds=last / segment.rate)
        pieces.append(replace(segment, samples=segment.samples[:first]))
        pieces.append(replace(segment, samples=segment.samples[last:], start=later))
    return pieces


@pytest.mark.parametrize("gap", [2, 20, 60])
def test_a_gap_just_before_an_earthquake_does_not_hide_it(gap: float) -> None:
    (window,) = windows(without(record([155]), 150 - gap, 150), SETTINGS)
    assert (window.start - START).total_seconds() == pytest.approx(135, abs=1)


@pytest.mark.parametrize("gap", [2, 20, 60])
def test_a_gap_in_noise_is_no_earthquake(gap: float) -> None:
    assert windows(without(record([]), 150 - gap, 150), SETTINGS) == ()


def test_a_gap_in_the_middle_of_an_earthquake_makes_no_second_one() -> None:
    (window,) = windows(without(record([148]), 150, 153), SETTINGS)
    assert (window.start - START).total_seconds() == pytest.approx(128, abs=1)
    assert (window.end - START).total_seconds() >= 158 + 30


def test_a_rate_that_changes_from_one_file_to_the_next_stops_nothing() -> None:
    later = START + timedelta(seconds=300)
    faster = [replace(segment, start=later) for segment in record([60], rate=200.0)]
    (window,) = windows([*record([]), *faster], SETTINGS)
    assert (window.start - START).total_seconds() == pytest.approx(340, abs=1)


def test_records_far_apart_do_not_fill_the_memory_between_them() -> None:
    """Two earthquakes five years apart: 16 thousand million samples a channel with the gap filled."""
    first = record([60])
    later = [replace(segment, start=segment.start + timedelta(days=1826)) for segment in first]
    tracemalloc.start()
    found = windows([*first, *later], SETTINGS)
    assert tracemalloc.get_traced_memory()[1] < 50_000_000
    tracemalloc.stop()
    assert len(found) == 2
    assert found[1].start - found[0].start == timedelta(days=1826)


def test_records_scattered_over_years_are_refused() -> None:
    pieces = [Recorded("A", START + timedelta(hours=5 * n), 100.0, np.ones(2), 1.0, "acceleration") for n in range(200)]
    check_gaps(pieces[:50])
    with pytest.raises(FormatError, match=r"would have 3\.58e\+08 samples, at most 2e\+08 are accepted; send shorter"):
        check_gaps(pieces)
