"""Explanations of a change by a wrong mass or gain."""

import numpy as np
import pytest
from drift_histories import START, Plan, series_in_both_directions

from core.drift.explanations import Shift, explanations, shifts
from core.drift.monitor import Reference, monitor

PLAN = Plan(events=80, giant=False, outliers=0.0, scatter=(0.01, 0.01))
ONSET = 45


def layer_shifts(x: float, y: float, frequency: float = 0.0) -> tuple[Shift, ...]:
    return (
        Shift("stiffness", "x", x, 0.004),
        Shift("damping", "x", x, 0.02),
        Shift("stiffness", "y", y, 0.004),
        Shift("frequency", "x/1", frequency, 0.003),
    )


def possible(result: tuple[Shift, ...]) -> list[str]:
    return [one.cause for one in explanations(result) if one.is_possible]


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


def test_one_series_has_no_explanation() -> None:
    assert explanations(layer_shifts(-0.08, 0.0)[:1]) == ()


def test_shifts_are_estimated_in_every_series() -> None:
    one, other = (monitor(side, Reference(), {}) for side in series_in_both_directions(PLAN, 31, ONSET, 0.06))
    moved = shifts((one, other), one.values[ONSET].time)
    assert [(shift.quantity, shift.subject) for shift in moved] == [("stiffness", "x"), ("stiffness", "y")]
    for shift in moved:
        assert abs(shift.size - np.log(0.94)) < 3 * shift.std
    assert shifts((one,), START.replace(year=2090)) == ()
