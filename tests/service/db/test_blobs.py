"""Series come back bit by bit, smaller than they were."""

import blosc2  # noqa: F401  else the first example waits for it beyond its deadline
import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import given, strategies as st

from service.analyses.tables import DELETED
from service.db.blobs import ROUNDING, Series, decode, decode_history, encode, encode_deviation, encode_history

dtypes = st.sampled_from([np.int32, np.float32, np.float64])


@given(series=dtypes.flatmap(lambda dtype: arrays.arrays(dtype, st.integers(0, 300))))
def test_every_bit_comes_back(series: Series) -> None:
    back = decode(encode(series))
    assert back.dtype == series.dtype
    assert back.tobytes() == series.tobytes()  # bits, so that NaN and -0.0 count


def test_the_largest_jumps_come_back() -> None:
    ends = np.array([-(2**31), 2**31 - 1] * 1000, dtype=np.int32)
    assert np.array_equal(decode(encode(ends)), ends)


def test_counts_take_less_than_steim2() -> None:
    """Steim2 takes 1.92 bytes a sample of strong motion at 24 bits; these are smooth counts of 12 bits."""
    rng = np.random.default_rng(1)
    moving = np.convolve(rng.standard_normal(18_000), np.hanning(40), mode="same")
    counts = np.round(2**11 * moving / np.abs(moving).max()).astype(np.int32)
    assert len(encode(counts)) / counts.size < 1.92


@pytest.mark.parametrize("series", [np.zeros(3, np.int16), np.zeros((2, 2))], ids=["dtype", "shape"])
def test_refuses_what_it_would_not_give_back(series: Series) -> None:
    with pytest.raises(TypeError, match="one-dimensional int32, float32 or float64"):
        encode(series)


@given(
    scale=st.floats(1e-9, 1e9),
    ratio=st.floats(1e-7, 10.0),
    count=st.integers(1, 300),
    seed=st.integers(0, 2**32 - 1),
)
def test_a_history_changes_by_less_than_its_uncertainty(scale: float, ratio: float, count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values, std = scale * rng.standard_normal(count), ratio * scale * rng.uniform(1.0, 3.0, count)
    blob = encode_history(values, std)
    back = decode_history(blob)
    assert back.dtype == np.float64
    assert np.all(np.abs(back - values) <= ROUNDING * std.min() * (1 + 1e-12))
    assert encode_history(back, std) == blob, "what was rounded once is not rounded again"


def test_a_smooth_history_takes_half_of_single_precision() -> None:
    """As one of a building: a motion below 5 Hz, known to a few parts in ten thousand of its peak."""
    rng = np.random.default_rng(2)
    force = 1e7 * np.convolve(rng.standard_normal(18_000), np.hanning(60), mode="same") / 15
    std = np.full(force.size, 3e3)
    before, blob = encode(force.astype(np.float32)), encode_history(force, std)
    assert len(blob) < 0.5 * len(before)


@given(arrays.arrays(np.float64, st.integers(0, 100), elements=st.floats(1e-30, 1e30)))
def test_a_deviation_keeps_three_digits(std: Series) -> None:
    np.testing.assert_allclose(decode_history(encode_deviation(std)), std, rtol=5e-4)


def test_a_deviation_that_is_unknown_stays_so() -> None:
    std = np.array([1.0, np.nan, np.inf, 0.0])
    np.testing.assert_array_equal(decode_history(encode_deviation(std)), std)


@pytest.mark.parametrize("std", [0.0, 1e-9, np.nan])
def test_a_history_known_better_than_single_precision_keeps_every_bit(std: float) -> None:
    force = 1e6 * np.random.default_rng(3).standard_normal(100)
    assert np.array_equal(decode_history(encode_history(force, np.full(100, std))), force)


def test_a_history_that_an_earlier_version_stored_is_read() -> None:
    force = np.random.default_rng(4).standard_normal(100)
    assert np.array_equal(decode_history(encode(force)), force)
    single = force.astype(np.float32)
    assert np.array_equal(decode_history(encode(single)), single)


def test_a_deleted_history_has_no_samples() -> None:
    assert encode(np.zeros(0, np.float32)) == DELETED
