"""Series come back bit by bit, smaller than they were."""

import blosc2  # noqa: F401  else the first example waits for it beyond its deadline
import hypothesis.extra.numpy as arrays
import numpy as np
import pytest
from hypothesis import given, strategies as st

from service.db.blobs import ROUNDING, Series, decode, decode_history, encode, encode_history

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


def test_a_history_takes_half_the_bytes_and_changes_by_less_than_its_uncertainty() -> None:
    rng = np.random.default_rng(2)
    force = 1e6 * np.cumsum(rng.standard_normal(10_000)) / 100
    std = np.full(force.size, 2e3)
    blob = encode_history(force, std)
    assert decode(blob).dtype == np.float32
    assert len(blob) < 0.55 * len(encode(force))
    back = decode_history(blob)
    assert back.dtype == np.float64
    assert np.all(np.abs(back - force) <= ROUNDING * std)
    np.testing.assert_allclose(back, force, rtol=6e-8)


@pytest.mark.parametrize("std", [0.0, 1e-9, np.nan])
def test_a_history_known_better_than_single_precision_keeps_every_bit(std: float) -> None:
    force = 1e6 * np.random.default_rng(3).standard_normal(100)
    assert np.array_equal(decode_history(encode_history(force, np.full(100, std))), force)


def test_a_history_that_an_earlier_version_stored_is_read() -> None:
    force = np.random.default_rng(4).standard_normal(100)
    assert np.array_equal(decode_history(encode(force)), force)
