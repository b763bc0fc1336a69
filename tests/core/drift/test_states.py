"""Monitoring from the state that an earlier one left, against monitoring from all measurements."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from drift_histories import (
    Plan,
    gradual_loss,
    history,
    series,
    series_in_both_directions,
    series_until,
    sudden_loss,
)

from core.arrays import Vector
from core.drift.alarms import Alarm
from core.drift.deviations import EventValue
from core.drift.monitor import Monitoring, Reference, is_after, monitor
from core.drift.pooled import pooled
from core.drift.quantities import quantity
from core.drift.rules import PENDING_MARGIN, rule_roots, rules
from core.drift.screening import CAUTION, screened
from core.drift.series import Series

RELATIVE = 1e-9
PLAN = Plan(events=75, scatter=(0.008, 0.012))
EVENTS = PLAN.events


def of_events(whole: Series, events: Sequence[int]) -> Series:
    chosen = set(events)
    return replace(whole, measurements=tuple(one for one in whole.measurements if one.event in chosen))


def numbers(values: Sequence[EventValue]) -> list[tuple[object, ...]]:
    return [(one.event, one.count, one.is_reference, one.is_out_of_range, one.causes) for one in values]


def assert_equal(found: Monitoring, expected: Monitoring) -> None:
    """The same but for rounding."""
    assert numbers(found.values) == numbers(expected.values)
    for name in ("value", "std"):
        own, other = ([getattr(one, name) for one in side.values] for side in (found, expected))
        assert own == pytest.approx(other, rel=RELATIVE, abs=RELATIVE * 1e-3)
    assert [without_sizes(one) for one in found.alarms] == [without_sizes(one) for one in expected.alarms]
    for one, other in zip(found.alarms, expected.alarms, strict=True):
        assert (one.drift, one.low, one.high) == pytest.approx((other.drift, other.low, other.high), rel=RELATIVE)


def without_sizes(alarm: Alarm) -> Alarm:
    return replace(alarm, drift=0.0, low=0.0, high=0.0)


def continued(whole: Series, before: Monitoring | None, changed: Sequence[int]) -> Monitoring:
    """Monitoring of a series after some of its events have changed, from the state that was left."""
    if before is not None and before.baseline is not None and before.state is not None:
        known, first = before.state.summaries, {}
        for one in whole.measurements:
            first.setdefault(one.event, one.time)
        last = max(value.time for value in before.values if value.is_reference)
        if all(is_after(first[event], before.baseline, last, Reference()) for event in changed):
            omitted = [event for event in known.event.tolist() if event not in changed]
            given = of_events(whole, [event for event in first if event not in omitted])
            return monitor(given, earlier=before.baseline, before=before.state, omitted=omitted)
    return monitor(whole, earlier=before and before.baseline, before=before and before.state)


def changes(kind: str, seed: int) -> Vector:
    lived = history(PLAN, seed)
    return {
        "none": np.zeros(EVENTS),
        "sudden": sudden_loss(lived, 48, 0.05),
        "slow": gradual_loss(lived, 45, 0.005),
        "small": sudden_loss(lived, 50, 0.01),
    }[kind]


@pytest.mark.accuracy
@pytest.mark.parametrize("kind", ["none", "sudden", "slow", "small"])
@pytest.mark.parametrize("seed", range(3))
def test_events_that_come_late_or_again_give_what_all_measurements_give(seed: int, kind: str) -> None:
    """Random orders: most events come in time, some late, some are analysed again with other results."""
    rng, whole = np.random.default_rng([seed, 7]), series(history(PLAN, seed), changes(kind, seed))
    order = np.argsort(np.arange(EVENTS) + np.where(rng.random(EVENTS) < 0.15, rng.integers(1, 12, EVENTS), 0))
    before: Monitoring | None = None
    known: list[int] = []
    waiting: list[int] = []
    revised = whole
    continuing = 0
    for step, event in enumerate(order.tolist()):
        changed = [event]
        if known and rng.random() < 0.1:
            again = int(rng.choice(known[-10:]))
            factor = float(np.exp(0.02 * rng.standard_normal()))
            revised = replace(
                revised,
                measurements=tuple(
                    replace(one, value=factor * one.value) if one.event == again else one
                    for one in revised.measurements
                ),
            )
            changed.append(again)
        known.append(event)
        waiting += changed
        if step < 20 or (step < EVENTS - 1 and rng.random() < 0.6):  # some come together
            continue
        given = of_events(revised, known)
        before, waiting = continued(given, before, waiting), []
        continuing += before.unchanged > 0
        assert_equal(before, monitor(given))
    assert continuing > 5


@pytest.mark.parametrize("loss", [0.0, 0.04])
def test_the_mean_of_two_directions_goes_on_from_its_state(loss: float) -> None:
    sides = series_in_both_directions(PLAN, 31, 45, loss)
    before: list[Monitoring] = []
    for events in range(40, EVENTS, 3):
        given = [series_until(one, events) for one in sides]
        own = [
            continued(one, was, range(events - 3, events))
            for one, was in zip(given, before[:2] or [None] * 2, strict=True)
        ]
        mean = pooled(own[0], own[1], "xy", before[2].judged if before else None)
        expected = pooled(*(monitor(one) for one in given), "xy")
        assert_equal(mean, expected)
        assert mean.unchanged == (events - 3 if before else 0)
        before = [*own, mean]


@pytest.mark.parametrize("is_correlated", [False, True])
def test_screening_gives_the_statistics_of_all_onsets(is_correlated: bool) -> None:
    """Screened onsets stay below the thresholds by the full statistics, and the rules saw the same."""
    known, quiet = quantity("stiffness"), 0
    for seed in range(16):
        monitoring = monitor(series(history(PLAN, seed)))
        tested = monitoring.tested
        assert tested is not None
        if any(one.is_sure for one in monitoring.alarms):
            continue
        white = tested.innovations()
        last = [one.root[-15:].max() - one.rule.threshold for one in rule_roots(white, rules(known))]
        if is_correlated:
            none = np.zeros((tested.event.size, 0))
            tested = replace(tested, own=0 * tested.own, common=none, correlated=tested.covariance)
        expected = white.lower @ white.clipped
        found = screened(known, tested, expected[:-15])
        assert (found is None) == (max(last) >= PENDING_MARGIN - CAUTION)
        if found is not None:
            quiet += 1
            assert found == pytest.approx(expected, rel=RELATIVE, abs=1e-12)
    assert quiet > 3
