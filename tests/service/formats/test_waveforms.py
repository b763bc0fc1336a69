import warnings
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from threading import Event

import numpy as np
import pytest
from record_files import CHANNEL, KNET, START, logger_counts, record_file
from shared_data import BNCS, needs_shared

from service.formats import Contents, FormatError, Gain, UnknownUnitError, read

GAINS = {CHANNEL: Gain(1e-5, "acceleration")}


@pytest.mark.parametrize("dtype", [np.int32, np.float32, np.float64])
def test_miniseed_gives_the_very_numbers(dtype: type) -> None:
    samples = logger_counts(3000).astype(dtype)
    (trace,) = read("a", record_file("MSEED", samples), GAINS).traces
    assert (trace.channel, trace.start, trace.rate) == (CHANNEL, START, 100.0)
    assert trace.numbers.dtype == dtype
    assert np.array_equal(trace.numbers, samples)
    assert np.array_equal(trace.to_si(), samples.astype(np.float64) * 1e-5)


def test_a_gap_in_miniseed_makes_two_traces() -> None:
    first, second = read("a", record_file("MSEED", logger_counts(500), logger_counts(700)), GAINS).traces
    assert (first.numbers.size, second.numbers.size) == (500, 700)
    assert (second.start - first.start).total_seconds() == pytest.approx(15.0, abs=1e-6)


def test_miniseed_without_a_unit_is_refused_until_one_is_reported() -> None:
    with pytest.raises(UnknownUnitError, match="StationXML") as caught:
        read("a", record_file("MSEED", logger_counts(100)), {})
    assert caught.value.channels == (CHANNEL,)


def test_channels_without_a_unit_are_named_beside_those_that_have_one() -> None:
    both = record_file("MSEED", logger_counts(100)) + record_file(
        "MSEED", logger_counts(100), channel="XX.TOWER.02.HNX"
    )
    contents = read("a", both, GAINS)
    assert [trace.channel for trace in contents.traces] == [CHANNEL]
    assert contents.without_unit == ("XX.TOWER.02.HNX",)


@pytest.mark.parametrize("left", [1, 60, 100, 500, 4096, 5000, 8000])
def test_truncated_miniseed_is_refused_wherever_it_ends(left: int) -> None:
    whole = record_file("MSEED", logger_counts(10_000).astype(np.float64))
    assert len(whole) > 8192
    if left % 4096 == 0:  # whole records are a whole file: only the event's screening can miss the rest
        assert read("a", whole[:left], GAINS).traces
        return
    with pytest.raises(FormatError, match=r"truncated or damaged|truncated: |an unknown format"):
        read("a.mseed", whole[:left], GAINS)


def test_a_remainder_that_libmseed_ignores_is_not_dropped_silently() -> None:
    whole = record_file("MSEED", logger_counts(10_000).astype(np.float64))
    with pytest.raises(FormatError, match="truncated"):
        read("a.mseed", whole[:-100], GAINS)


def test_reading_makes_no_error_of_another_threads_warning() -> None:
    """Python's warning filters are the process's own: a reader once turned the whole service's warnings to errors."""
    whole, stop = record_file("MSEED", logger_counts(10_000)), Event()

    def reads() -> None:
        while not stop.is_set():
            read("a", whole, GAINS)

    with ThreadPoolExecutor(2) as readers, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        busy = [readers.submit(reads) for _ in range(2)]
        try:
            for _ in range(20_000):
                warnings.warn("nothing of the reader's", UserWarning, stacklevel=1)
        finally:
            stop.set()
    assert [reader.result() for reader in busy] == [None, None]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_no_number_is_refused(bad: float) -> None:
    samples = logger_counts(1000).astype(np.float64)
    samples[[17, 400]] = bad
    with pytest.raises(
        FormatError, match=r"2 of 1000 samples of XX.TOWER.01.HNX are not numbers, the first at sample 18"
    ):
        read("a", record_file("MSEED", samples), GAINS)


def test_text_in_miniseed_is_refused() -> None:
    with pytest.raises(FormatError, match=r"\|S1; use integers or floats"):
        read("a", record_file("MSEED", np.frombuffer(b"a log line", dtype="|S1")), GAINS)


def test_sac_gives_the_very_numbers() -> None:
    samples = logger_counts(400).astype(np.float32)
    (trace,) = read("a", record_file("SAC", samples), GAINS).traces
    assert np.array_equal(trace.numbers, samples)
    assert abs((trace.start - START).total_seconds()) < 1e-3  # SAC keeps milliseconds
    assert trace.quantity == "acceleration"


def test_truncated_sac_is_refused() -> None:
    with pytest.raises(FormatError, match=r"a\.sac is truncated or damaged"):
        read("a.sac", record_file("SAC", logger_counts(400).astype(np.float32))[:-200], GAINS)


def test_knet_states_its_unit_and_its_peak() -> None:
    """The header of the record prints its largest acceleration: 4.383 gal."""
    (trace,) = read("a", KNET.read_bytes(), {}).traces
    assert (trace.channel, trace.rate, trace.numbers.size) == ("BO.AKT013..EW", 100.0, 5900)
    assert trace.numbers.dtype == np.int32
    samples = trace.to_si()
    assert np.abs(samples - samples.mean()).max() == pytest.approx(0.04383, abs=5e-6)  # half the printed digit


def test_knet_time_is_utc_and_without_the_loggers_delay() -> None:
    """Record Time 1996/08/11 03:12:39 is Japanese time, 15 s after the first sample."""
    (trace,) = read("a", KNET.read_bytes(), {}).traces
    assert trace.start == datetime(1996, 8, 10, 18, 12, 24, tzinfo=UTC)


@pytest.mark.parametrize(("number", "code"), [("1", "NS1"), ("5", "EW2"), ("6", "UD2")])
def test_kiknet_numbers_its_directions(number: str, code: str) -> None:
    """1 to 3 are in the borehole, 4 to 6 at the surface."""
    text = KNET.read_bytes().replace(b"E-W", number.encode())
    (trace,) = read("a", text, {}).traces
    assert trace.channel == f"BO.AKT013..{code}"


def test_truncated_knet_is_refused() -> None:
    lines = KNET.read_bytes().splitlines(keepends=True)
    with pytest.raises(FormatError, match="promises 5900 samples, 5800 follow"):
        read("a", b"".join(lines[: 17 + 725]), {})
    with pytest.raises(FormatError, match="truncated or"):
        read("a", b"".join(lines[:9]), {})


@needs_shared
def test_real_records_have_the_amplitudes_that_their_readme_prints() -> None:
    gains = read("station.xml", (BNCS / "station.xml").read_bytes(), {}).gains
    printed = {"CNP100": (2.05, 87), "LAC100": (2.18, 115), "SP100": (5.14, 143)}  # m/s², mm
    for name, (pga, displacement) in printed.items():
        contents: Contents = read(name, (BNCS / f"{name}.mseed").read_bytes(), gains)
        peak = {trace.channel: float(np.abs(trace.to_si()).max()) for trace in contents.traces}
        assert peak["XX.BNCS.00.HNX"] == pytest.approx(pga, abs=0.005)  # half the printed digit
        assert peak["XX.BNCS.01.HYX"] * 1e3 == pytest.approx(displacement, abs=0.5)
