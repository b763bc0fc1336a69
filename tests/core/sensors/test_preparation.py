"""Segments of a channel make one trace, and channels of any rate and start come to one time base."""

import tracemalloc
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import paper_records
import pytest
from building_models import START

from core.errors import RecordError
from core.record import Channel, Segment
from core.sensors.preparation import joined, on_one_time_base, prepared
from service.buildings import description as building_description

CHANNELS = (Channel("a", "1F", "acceleration", "x"), Channel("b", "RF", "acceleration", "x"))


def motion(time: np.ndarray) -> np.ndarray:
    return np.sin(2 * np.pi * 1.3 * time) + 0.3 * np.cos(2 * np.pi * 7 * time)


def piece(channel: str, begin: float, end: float, rate: float = 100.0) -> Segment:
    time = np.arange(begin, end, 1 / rate)
    return Segment(channel, START + timedelta(seconds=begin), rate, motion(time))


def test_contiguous_segments_in_any_order_are_one_trace() -> None:
    trace, result = joined([piece("a", 10, 20), piece("a", 0, 10)])
    assert trace.samples == pytest.approx(motion(np.arange(2000) / 100), abs=1e-9)
    assert result == ()


def test_samples_sent_twice_are_noted_and_count_once() -> None:
    trace, result = joined([piece("a", 0, 12), piece("a", 10, 20)])
    assert trace.samples.size == 2000
    assert [(f.kind, f.severity) for f in result] == [("overlap", "note")]


def test_contradicting_overlap_is_a_warning() -> None:
    late = piece("a", 10, 20)
    other = Segment("a", late.start, late.rate, late.samples + 0.1)
    result = joined([piece("a", 0, 12), other])[1]
    assert [(f.kind, f.severity, f.value) for f in result] == [("overlap", "warning", 2.0)]


def test_a_gap_is_left_as_missing() -> None:
    trace, _ = joined([piece("a", 0, 10), piece("a", 10.5, 20)])
    assert int(np.isnan(trace.samples).sum()) == 50


def test_two_rates_in_one_channel_are_refused() -> None:
    with pytest.raises(RecordError, match="one rate"):
        joined([piece("a", 0, 10), piece("a", 10, 20, rate=200.0)])


@pytest.mark.parametrize("offset", [0.0, 0.0037, 1.25])
@pytest.mark.parametrize("rate", [100.0, 200.0])
def test_channels_of_other_rates_and_starts_come_to_the_same_instants(offset: float, rate: float) -> None:
    traces = {"a": joined([piece("a", 0, 30)])[0], "b": joined([piece("b", offset, 31, rate)])[0]}
    record = on_one_time_base(traces, CHANNELS, 100.0)
    assert record.start == START + timedelta(seconds=offset)
    # 80 dB of the filter and datetime's microseconds; the filter's half length, 0.7 s, is left out at the ends
    assert record.samples[0, 100:-100] == pytest.approx(record.samples[1, 100:-100], abs=1e-3)


def test_a_short_channel_does_not_cut_the_others() -> None:
    traces = {"a": joined([piece("a", 0, 30)])[0], "b": joined([piece("b", 0, 10)])[0]}
    record = on_one_time_base(traces, CHANNELS, 100.0)
    assert record.samples.shape == (2, 3000)
    assert int(np.isnan(record.samples[1]).sum()) == 2000


def test_channels_without_common_time_are_refused() -> None:
    traces = {"a": joined([piece("a", 0, 10)])[0], "b": joined([piece("b", 20, 30)])[0]}
    with pytest.raises(RecordError, match="no time in common"):
        on_one_time_base(traces, CHANNELS, 100.0)


FIRST = datetime(2024, 1, 1, tzinfo=UTC)


def test_an_event_of_four_months_is_refused_with_its_length() -> None:
    """At 0.0001 Hz: 1000 samples; at the chain's 100 Hz thousands of millions in each channel."""
    description = building_description.read(paper_records.building_file(), Path("/")).description
    channels = [channel.id for channel in description.channels]
    slow = [Segment(channel, FIRST, 1e-4, np.zeros(1000)) for channel in channels]
    apart = [Segment(channels[0], FIRST + timedelta(days=n), 100.0, np.zeros(1000)) for n in (0, 116)]
    tracemalloc.start()
    for segments in (slow, apart):
        preparation = prepared(segments, description, 100.0)
        (finding,) = preparation.findings
        assert preparation.record is None
        assert finding.severity == "fatal"
        assert finding.message.startswith("the event lasts 2.78e+03 h, 1e+09 samples per channel; the limit is 2.5e+07")
    assert tracemalloc.get_traced_memory()[1] < 10_000_000
    tracemalloc.stop()
