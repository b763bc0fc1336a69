"""The baseline against known curves, and the coverage of its band."""

import numpy as np
import pytest
from drift_histories import History, Plan, history, series, stiffness_curve

from core.drift.baseline import Baseline
from core.drift.monitor import Reference, monitor


def baseline(lived: History) -> Baseline:
    monitoring = monitor(series(lived), Reference(), {}).baseline
    assert monitoring is not None
    return monitoring


def test_a_curve_without_scatter_is_recovered() -> None:
    plan = Plan(events=40, giant=False, outliers=0.0, scatter=(1e-4, 1e-4), own=(1e-3, 1e-3))
    result = baseline(history(plan, 1))
    low, high = result.range or (0.0, 0.0)
    amplitude = np.geomspace(1.05 * low, high / 1.05, 40)
    mean, std = result.expected(amplitude, temperature=15.0)
    truth = stiffness_curve(np.random.default_rng(1))(amplitude)  # the history draws its curve first
    assert (
        np.abs(mean - truth).max() < 0.01
    )  # the prior of event scatter, 0.17 % at least, keeps the curve from the data
    assert np.sqrt(np.mean((mean - truth) ** 2)) < 0.003
    assert (std > 0).all()


@pytest.mark.accuracy
@pytest.mark.parametrize(("scatter", "outliers"), [(0.01, 0.0), (0.02, 0.0), (0.01, 0.02)])
def test_the_band_covers_95_percent(scatter: float, outliers: float) -> None:
    """95 % of the events after the reference, to within what 24 histories that each share a baseline leave: 4 %."""
    inside = []
    for seed in range(24):
        plan = Plan(events=60, giant=False, scatter=(scatter, scatter), outliers=outliers)
        values = [
            value for value in monitor(series(history(plan, seed)), Reference(), {}).values if not value.is_reference
        ]
        inside += [abs(np.log1p(value.value)) < 1.96 * value.std / (1 + value.value) for value in values]
    assert np.mean(inside) == pytest.approx(0.95, abs=0.04)


def test_the_band_widens_outside_the_range() -> None:
    curve = baseline(history(Plan(events=40, giant=False), 3))
    low, high = curve.range or (0.0, 0.0)
    _, std = curve.expected(np.array([np.sqrt(low * high), high, 2 * high, 5 * high]))
    assert (np.diff(std) > 0).all()
    assert std[-1] > 3 * std[0]


def test_a_temperature_outside_the_reference_widens_the_band() -> None:
    curve = baseline(history(Plan(events=40, giant=False), 3))
    low, high = curve.range or (0.0, 0.0)
    middle = np.array([np.sqrt(low * high)])
    stds = [float(curve.expected(middle, temperature)[1][0]) for temperature in (None, 15.0, -10.0)]
    assert stds[2] > stds[1] >= 0.9 * stds[0]


def test_one_outlying_event_moves_the_curve_little() -> None:
    lived = history(Plan(events=40, giant=False, outliers=0.0), 5)
    whole = series(lived, np.where(np.arange(40) == 7, 0.5, 0.0))
    wild = monitor(whole, Reference(), {}).baseline
    assert wild is not None
    healthy = baseline(lived)
    low, high = healthy.range or (0.0, 0.0)
    amplitude = np.geomspace(low, high, 20)
    moved = wild.expected(amplitude)[0] - healthy.expected(amplitude)[0]
    assert np.sqrt(np.mean(moved**2)) < 0.01  # of 0.5 / 20 events by least squares it would be 0.025


@pytest.mark.accuracy
def test_the_scatter_between_events_is_estimated() -> None:
    for scatter in (0.005, 0.01, 0.02):
        plan = Plan(events=40, giant=False, outliers=0.0, scatter=(scatter, scatter))
        results = [baseline(history(plan, seed)).scatter.events for seed in range(12)]
        # 12 histories of 20 events: 5 %; and up to a fifth that the prior's mean of 1 % takes
        assert np.mean(results) == pytest.approx(scatter, rel=0.25)
