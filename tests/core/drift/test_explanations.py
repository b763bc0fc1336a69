"""Explanations of a change by a wrong mass or gain, and the pooled monitoring of two directions."""

from dataclasses import replace

import numpy as np
import pytest
from drifting import START, Plan, history, other_direction, series, stepped

from core.drift.explanations import Shift, explanations, shifts
from core.drift.monitor import Monitoring, Reference, monitor
from core.drift.pooled import pooled, pooled_alarms, scatter_correlation
from core.errors import ModelError

PLAN = Plan(events=80, giant=False, outliers=0.0, scatter=(0.01, 0.01))
ONSET = 45


def layer_shifts(x: float, y: float, frequency: float = 0.0) -> tuple[Shift, ...]:
    return (
        Shift("stiffness", "x", x, 0.004),
        Shift("damping", "x", x, 0.02),
        Shift("stiffness", "y", y, 0.004),
        Shift("frequency", "x/1", frequency, 0.003),
    )


def possible(found: tuple[Shift, ...]) -> list[str]:
    return [one.cause for one in explanations(found) if one.is_possible]


def test_a_mass_scales_everything() -> None:
    assert possible(layer_shifts(-0.08, -0.08, -0.04)) == ["mass"]
    best = explanations(layer_shifts(-0.08, -0.08, -0.04))[0]
    assert best.size == pytest.approx(np.expm1(0.08), rel=1e-6)
    assert "+8.3 %" in best.message


def test_a_gain_scales_one_direction() -> None:
    assert possible(layer_shifts(-0.08, 0.0)) == ["gain/x"]
    assert possible(layer_shifts(0.0, -0.08)) == ["gain/y"]


def test_a_softer_layer_alone_rules_both_out() -> None:
    assert possible(layer_shifts(-0.08, -0.05)) == []


def test_one_series_tells_nothing() -> None:
    assert explanations(layer_shifts(-0.08, 0.0)[:1]) == ()


def both(loss: float) -> tuple[Monitoring, Monitoring]:
    lived = history(PLAN, 31)
    other = other_direction(PLAN, lived, 31, 0.3)
    sides = series(lived, stepped(lived, ONSET, loss)), replace(series(other, stepped(other, ONSET, loss)), subject="y")
    one, two = (monitor(side, Reference(), {}) for side in sides)
    return one, two


def test_shifts_are_measured_in_every_series() -> None:
    one, other = both(0.06)
    found = shifts((one, other), one.values[ONSET].time)
    assert [(shift.quantity, shift.subject) for shift in found] == [("stiffness", "x"), ("stiffness", "y")]
    for shift in found:
        assert abs(shift.size - np.log(0.94)) < 3 * shift.std
    assert shifts((one,), START.replace(year=2090)) == ()


def test_a_loss_in_both_directions_is_told_by_their_mean() -> None:
    one, other = both(0.04)
    (alarm,) = [alarm for alarm in pooled_alarms(one, other) if alarm.is_sure]
    assert alarm.onset in (ONSET - 1, ONSET)
    assert alarm.low < -0.04 < alarm.high
    assert 0.0 <= scatter_correlation(one, other) < 0.8
    assert not [alarm for alarm in pooled_alarms(*both(0.0)) if alarm.is_sure]


def test_the_mean_has_the_values_that_its_rules_judge() -> None:
    """Exactly so, but for the softening and the curve, which the judged covariance has between events only."""
    one, other = both(0.04)
    mean = pooled(one, other, "xy")
    assert (mean.series.quantity, mean.series.subject, mean.baseline, mean.events_needed) == (
        "stiffness",
        "xy",
        None,
        0,
    )
    assert [replace(alarm, causes=()) for alarm in mean.alarms] == list(pooled_alarms(one, other))
    assert all(any("mass" in cause for cause in alarm.causes) for alarm in mean.alarms)
    sides = [{value.event: value for value in side.values} for side in (one, other)]
    common = scatter_correlation(one, other)
    for value in mean.values:
        first, last = (side[value.event] for side in sides)
        assert np.log1p(value.value) == pytest.approx((np.log1p(first.value) + np.log1p(last.value)) / 2, abs=1e-12)
        errors = [side.std / (1 + side.value) for side in (first, last)]
        exact = np.sqrt(np.array(errors) @ np.array([[1, common], [common, 1]]) @ np.array(errors)) / 2
        assert value.std == pytest.approx((1 + value.value) * exact, rel=1e-12)
        assert value.is_reference == (first.is_reference or last.is_reference)
    after = [value.value for value in mean.values if value.event >= ONSET]
    assert np.mean(after) == pytest.approx(-0.04, abs=0.005)  # 35 events that scatter by 1 %


def test_different_quantities_have_no_mean() -> None:
    one, other = both(0.0)
    damping = replace(other, series=replace(other.series, quantity="damping"))
    with pytest.raises(ModelError, match="damping"):
        pooled_alarms(one, damping)
