"""Rubber that hardens with age is no change of stiffness, and a loss that its hardening hides is found."""

from datetime import date

import numpy as np
import pytest
from drift_histories import START, History, Plan, history, series

from core.arrays import Vector
from core.drift.ageing import RATES, Ageing, ageing_of
from core.drift.monitor import FIRST_EVENTS, Monitoring, monitor

OLD = Plan(events=240, giant=False, outliers=0.0, scatter=(0.008, 0.01), per_year=(12.0, 13.0))
"""Twenty years."""
INSTALLED = date(START.year - 5, START.month, START.day)


def hardened(lived: History, rate: float, lost: float = 0.0) -> Vector:
    """(events,) relative change since the start by a rate per year, five years after the bearings were installed."""
    years = lived.time / 365.2425
    return np.asarray((1 + rate * (years + 5.0)) / (1 + rate * 5.0) * (1 - lost * (years > years[-1] / 2)) - 1)


def monitored(lived: History, change: Vector, ageing: Ageing | None) -> Monitoring:
    return monitor(series(lived, change), FIRST_EVENTS, {}, ageing)


def test_the_rates_are_those_of_the_sources() -> None:
    """Natural rubber 14.6 % in 30 years, high-damping 5 to 26 % in 60, lead-rubber 5 % in ten."""
    years = {"natural": 30, "high_damping": 60, "lead": 10}
    grown = {name: rate * years[name] for name, (rate, _) in RATES.items()}
    assert grown == pytest.approx({"natural": 0.146, "high_damping": (0.05 + 0.26) / 2, "lead": 0.05})
    rate, std = RATES["high_damping"]
    assert [(rate + side * 2 * std) * 60 for side in (-1, 1)] == pytest.approx([0.05, 0.26])


def test_hardening_is_no_change_of_stiffness_where_the_compound_and_the_day_are_known() -> None:
    lived = history(OLD, 3)
    change = hardened(lived, RATES["natural"][0])
    assert change[-1] > 0.08
    plain, corrected = (monitored(lived, change, one) for one in (None, ageing_of("natural", INSTALLED)))
    assert [one.rule for one in plain.alarms if one.is_sure] != []
    assert [one.rule for one in corrected.alarms if one.is_sure] == []
    assert np.mean([one.value for one in plain.values[-20:]]) > 0.05
    last = corrected.values[-1]
    assert abs(np.mean([one.value for one in corrected.values[-20:]])) < 0.01
    assert last.std > 1.5 * plain.values[-1].std, "the rate of hardening is uncertain, more so with the years"


def test_a_loss_that_hardening_hides_is_found() -> None:
    lived = history(OLD, 4)
    change = hardened(lived, RATES["natural"][0], lost=0.06)
    corrected = monitored(lived, change, ageing_of("natural", INSTALLED))
    first = next(one for one in corrected.alarms if one.is_sure)
    lost = int(np.argmax(lived.time > lived.time[-1] / 2))
    assert first.rule == "sudden"
    assert abs(first.onset - lost) <= 2
    assert first.drift == pytest.approx(-0.06, abs=0.015)  # as in the tests of losses without hardening


def test_nothing_is_corrected_without_compound_or_day_and_other_quantities_do_not_harden() -> None:
    assert ageing_of(None, INSTALLED) is None
    assert ageing_of("natural", None) is None
    lived = history(OLD, 5)
    known = ageing_of("natural", INSTALLED)
    damping = type(series(lived))("damping", "x", series(lived).measurements)
    with_age, without = (monitor(damping, FIRST_EVENTS, {}, one) for one in (known, None))
    assert with_age.values == without.values


def test_rubber_is_new_until_it_is_installed() -> None:
    ageing = Ageing(installed=0.0, rate=0.005, std=0.001)
    year = 365.2425 * 86400
    times = year * np.array([-3.0, 0.0, 10.0])
    assert np.exp(ageing.change(times, 0.0)) == pytest.approx([1.0, 1.0, 1.05])
    faster = Ageing(installed=0.0, rate=0.006, std=0.0)
    drift = faster.change(times, 5 * year) - ageing.change(times, 5 * year)
    assert ageing.change_std(times, 5 * year) == pytest.approx(drift, rel=0.02)
