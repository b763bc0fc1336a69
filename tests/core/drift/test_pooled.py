"""Pooled monitoring of two directions."""

from dataclasses import replace

import numpy as np
import pytest
from drift_histories import Plan, series_in_both_directions

from core.drift.monitor import Monitoring, Reference, monitor
from core.drift.pooled import pooled, pooled_alarms, scatter_correlation
from core.errors import ModelError

PLAN = Plan(events=80, giant=False, outliers=0.0, scatter=(0.01, 0.01))
ONSET = 45


def both(loss: float) -> tuple[Monitoring, Monitoring]:
    one, other = (monitor(side, Reference(), {}) for side in series_in_both_directions(PLAN, 31, ONSET, loss))
    return one, other


def test_a_loss_in_both_directions_raises_an_alarm_on_their_mean() -> None:
    one, other = both(0.04)
    (alarm,) = [alarm for alarm in pooled_alarms(one, other) if alarm.is_sure]
    assert alarm.onset in (ONSET - 1, ONSET)
    assert alarm.low < -0.04 < alarm.high
    assert 0.0 <= scatter_correlation(one, other) < 0.8
    assert not [alarm for alarm in pooled_alarms(*both(0.0)) if alarm.is_sure]


def test_pooled_values_are_those_that_the_rules_test() -> None:
    """Exactly so, but for the softening and the curve, which the tested covariance has between events only."""
    one, other = both(0.04)
    mean = pooled(one, other, "xy")
    assert (mean.series.quantity, mean.series.subject) == ("stiffness", "xy")
    assert (mean.baseline, mean.events_needed) == (None, 0)
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


def test_different_quantities_cannot_be_pooled() -> None:
    one, other = both(0.0)
    damping = replace(other, series=replace(other.series, quantity="damping"))
    with pytest.raises(ModelError, match="damping"):
        pooled_alarms(one, damping)
