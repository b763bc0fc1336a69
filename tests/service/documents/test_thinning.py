import numpy as np
import pytest
from hypothesis import given, strategies as st
from hypothesis.extra import numpy as hnp

from service.documents.thinning import along_path, extremes

series = hnp.arrays(np.float64, st.integers(1, 3000), elements=st.floats(-1e6, 1e6))


@given(values=series, points=st.integers(4, 500))
def test_no_peak_is_lost_and_no_point_too_many(values: np.ndarray, points: int) -> None:
    kept = extremes(values, points)
    assert kept.size <= max(points, 0)
    assert (np.diff(kept) > 0).all()
    assert kept[0] == 0
    assert kept[-1] == values.size - 1
    assert values[kept].max() == values.max()
    assert values[kept].min() == values.min()


def test_one_spike_in_a_hundred_thousand_samples_stays() -> None:
    values = np.zeros(100_000)
    values[54_321] = -1.0
    assert 54_321 in extremes(values, 100)


def test_every_pixel_keeps_its_extremes() -> None:
    values = np.random.default_rng(2).normal(size=1000)
    kept = extremes(values, 102)  # 50 pixels of 20 samples, and both ends
    for pixel in range(50):
        inside = slice(20 * pixel, 20 * pixel + 20)
        assert 20 * pixel + values[inside].argmax() in kept
        assert 20 * pixel + values[inside].argmin() in kept


def test_a_short_series_is_kept_whole() -> None:
    assert extremes(np.arange(50.0), 50).tolist() == list(range(50))


def test_what_is_no_number_is_no_extreme() -> None:
    values = np.sin(np.arange(2000) / 50)
    values[700:900] = np.nan
    kept = extremes(values, 100)
    assert np.nanmax(values[kept]) == np.nanmax(values)


def test_too_few_points_are_refused() -> None:
    with pytest.raises(ValueError, match="cannot be thinned to 3 points; 4 or more are needed"):
        extremes(np.zeros(10), 3)


def test_a_loop_keeps_its_shape() -> None:
    """One cycle slow, one fast: the polygon through the kept points has the ellipse's area to the chord's error."""
    angle = np.concatenate([np.linspace(0, 2 * np.pi, 20_000), np.linspace(0, 2 * np.pi, 400)])
    x, y = 0.1 * np.cos(angle), 3e5 * np.sin(angle)
    kept = along_path(x, y, 1 / 60)
    assert kept[0] == 0
    assert kept[-1] == angle.size - 1
    assert kept.size < 2 * 3.2 * 60  # two cycles, each π diameters long
    slow = kept[kept < 20_000]
    area = 0.5 * abs(np.sum(x[slow] * np.roll(y[slow], -1) - y[slow] * np.roll(x[slow], -1)))
    # a polygon of n sides in a circle has its area less (2π/n)²/6: 2e-4 for n = 188
    assert area == pytest.approx(np.pi * 0.1 * 3e5, rel=5e-4)


def test_rest_needs_few_points() -> None:
    x = np.concatenate([np.linspace(0, 1, 100), np.ones(10_000)])
    assert along_path(x, x, 1 / 60).size < 130


def test_a_point_that_never_moves_is_two_points() -> None:
    assert along_path(np.zeros(100), np.zeros(100), 1 / 60).tolist() == [0, 99]
