"""Written numbers are JSON that every reader takes for the numbers they were."""

import json

import numpy as np
import orjson
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from service.http.series import DIGITS, rounded, series_json

series = hnp.arrays(np.float64, st.integers(1, 50), elements=st.floats(-1e9, 1e9))


@given(values=series)
def test_read_back_they_are_the_rounded_ones(values: np.ndarray) -> None:
    text = orjson.dumps({"force": series_json(values)})
    assert json.loads(text)["force"] == orjson.loads(text)["force"] == rounded(values).tolist()


@given(values=series)
def test_they_have_eight_digits_of_the_peak(values: np.ndarray) -> None:
    """Half of the last place, which is at most 10^(1 − DIGITS) of the peak."""
    assert abs(rounded(values) - values).max() <= 0.5001 * 10.0 ** (1 - DIGITS) * abs(values).max()


def test_what_is_not_finite_is_null() -> None:
    values = np.array([1.5, np.nan, np.inf])
    assert json.loads(orjson.dumps(series_json(values))) == [1.5, None, None]


def test_a_place_is_shared_and_seen() -> None:
    assert orjson.dumps(series_json(np.array([1234.5, -0.001]))) == b"[12345000e-4,-10e-4]"
    assert orjson.dumps(series_json(np.zeros(2))) == b"[0.0,0.0]"
    assert orjson.dumps(series_json(np.zeros(0))) == b"[]"
