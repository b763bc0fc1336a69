"""Monitoring of a series: changes that must raise an alarm, and histories that must not."""

from dataclasses import replace
from datetime import timedelta
from itertools import pairwise
from random import Random

import numpy as np
import pytest
from drift_histories import History, Plan, gradual_loss, history, rescaled, series, series_until, sudden_loss

from core.arrays import Vector
from core.drift.alarms import HINDSIGHT, Alarm
from core.drift.deviations import EventNotes
from core.drift.monitor import Monitoring, Reference, monitor
from core.drift.series import Series
from core.errors import ModelError
from core.record import Finding

QUIET = Plan(events=80, giant=False, outliers=0.0, scatter=(0.008, 0.01))
"""Histories in which every change of this file is many standard deviations large."""
CALIBRATION = Finding("neighbour", "warning", "reads 8 % more than its neighbours", "XX.DEMO.01.HNX", 0.08)


def monitored(lived: History, change: Vector | None = None) -> Monitoring:
    return monitor(series(lived, change), Reference(), {})


def sure(result: Monitoring) -> list[Alarm]:
    return [alarm for alarm in result.alarms if alarm.is_sure]


@pytest.mark.parametrize("seed", range(10, 16))
def test_a_sudden_loss_raises_an_alarm_within_three_events(seed: int) -> None:
    lived = history(QUIET, seed)
    (alarm,) = sure(monitored(lived, sudden_loss(lived, 50, 0.08)))
    assert alarm.rule == "sudden"
    assert alarm.onset in (49, 50)  # the event before may happen to be low too
    assert 50 <= alarm.raised <= 52
    assert alarm.events[-1] == alarm.raised
    assert len(alarm.events) >= 2
    assert alarm.drift == pytest.approx(-0.08, abs=0.015)  # three times what 30 events and 20 of the reference leave
    assert alarm.low < alarm.drift < alarm.high


def test_a_slow_loss_is_recognised_as_slow() -> None:
    lived = history(QUIET, 20)
    first = sure(monitored(lived, gradual_loss(lived, 45, 0.006)))[0]
    assert first.rule == "slow"
    assert 45 < first.raised < 57


def test_a_repair_is_noticed() -> None:
    lived = history(QUIET, 21)
    lost, repaired = sure(monitored(lived, sudden_loss(lived, 40, 0.08) - sudden_loss(lived, 60, 0.08)))
    assert (lost.rule, lost.onset) == ("sudden", 40)
    assert (repaired.rule, repaired.onset) == ("recovery", 60)
    assert repaired.drift > 0.05


def test_a_second_loss_raises_its_own_alarm() -> None:
    lived = history(QUIET, 22)
    one, other = sure(monitored(lived, sudden_loss(lived, 40, 0.08) + sudden_loss(lived, 60, 0.08)))
    assert (one.onset, other.onset) == (40, 60)


def test_a_single_event_never_raises_an_alarm() -> None:
    lived = history(QUIET, 23)
    change = np.zeros(QUIET.events)
    change[50] = -0.5
    monitoring = monitored(lived, change)
    assert not sure(monitoring)
    pending = monitor(series_until(series(lived, change), 51), Reference(), {}).alarms
    assert [alarm.is_sure for alarm in pending] == [False]
    assert pending[0].onset == pending[0].raised == 50


def test_damage_within_an_event_raises_an_alarm_at_once() -> None:
    lived = history(replace(QUIET, own=(0.01, 0.02)), 24)
    event = next(n for n in range(40, 80) if 5 < lived.amplitude[n].argmax() < lived.amplitude[n].size - 10)
    whole = series(lived)
    largest = max((one for one in whole.measurements if one.event == event), key=lambda one: one.amplitude or 0.0)
    damaged = tuple(
        replace(one, value=0.8 * one.value) if one.event == event and one.time > largest.time else one
        for one in whole.measurements
    )
    alarms = sure(monitor(series_until(replace(whole, measurements=damaged), event + 1), Reference(), {}))
    assert [(alarm.rule, alarm.onset, alarm.raised) for alarm in alarms] == [("within", event, event)]
    assert alarms[0].low < -0.2 < alarms[0].high


def test_a_giant_earthquake_raises_no_alarm() -> None:
    lived = history(replace(QUIET, giant=True), 25)
    assert lived.giant is not None
    monitoring = monitored(lived)
    assert not sure(monitoring)
    giant = monitoring.values[lived.giant]
    assert giant.causes, "an earthquake larger than all before is a possible cause"


def test_softening_that_recovers_raises_no_alarm() -> None:
    lived = history(replace(QUIET, giant=True, scragging=0.05), 25)
    assert not sure(monitored(lived))


@pytest.mark.parametrize("seed", range(40, 52))
def test_many_changes_raise_alarms_one_after_the_other(seed: int) -> None:
    """Losses and repairs at random: every alarm begins after the one before was raised."""
    lived, rng = history(Plan(events=100), seed), np.random.default_rng(seed)
    level = np.cumsum(rng.choice([-0.06, 0.0, 0.06], size=5, p=[0.4, 0.3, 0.3]))
    alarms = monitored(lived, np.repeat([0.0, *level], [25, 15, 15, 15, 15, 15])).alarms
    over_events = [alarm for alarm in alarms if alarm.rule != "within"]
    for one, following in pairwise(over_events):
        assert one.is_sure
        assert one.onset <= one.raised < following.onset <= following.raised
    for alarm in over_events:
        assert set(alarm.events) >= {alarm.onset, alarm.raised}
        assert alarm.low < alarm.drift < alarm.high


@pytest.mark.parametrize("has_thermometer", [True, False])
def test_winters_raise_no_alarm(has_thermometer: bool) -> None:
    plan = replace(QUIET, events=120, per_year=(15.0, 20.0), has_thermometer=has_thermometer)
    lived = history(plan, 26)
    assert np.ptp(lived.temperature) > 15.0
    monitoring = monitored(lived)
    assert not sure(monitoring)
    is_possible = any("temperature" in cause for value in monitoring.values for cause in value.causes)
    assert is_possible != has_thermometer


def test_sensor_findings_exclude_an_event_and_are_named() -> None:
    lived = history(QUIET, 27)
    whole = series(lived, sudden_loss(lived, 50, 0.08))
    notes = {event: EventNotes((CALIBRATION,)) for event in range(50, QUIET.events)}
    monitoring = monitor(whole, Reference(), notes)
    assert sure(monitor(whole, Reference(), {}))
    assert not monitoring.alarms
    assert all(value.is_excluded and CALIBRATION.message in value.causes for value in monitoring.values[50:])
    harmless = {event: EventNotes((replace(CALIBRATION, severity="note"),)) for event in range(50, QUIET.events)}
    assert sure(monitor(whole, Reference(), harmless))


def test_later_events_do_not_change_earlier_alarms() -> None:
    lived = history(QUIET, 28)
    whole = series(lived, sudden_loss(lived, 45, 0.05))
    every = [(alarm.rule, alarm.onset, alarm.raised) for alarm in sure(monitor(whole, Reference(), {}))]
    assert every
    for last in range(40, QUIET.events, 7):
        known = [(a.rule, a.onset, a.raised) for a in sure(monitor(series_until(whole, last), Reference(), {}))]
        assert [raised for _, _, raised in known] == [raised for _, _, raised in every if raised < last]
        settled = [one for one in every if one[2] < last - HINDSIGHT]
        assert known[: len(settled)] == settled


def test_the_order_of_arrival_and_repetition_change_nothing() -> None:
    lived = history(Plan(events=60), 5)
    whole = series(lived, sudden_loss(lived, 40, 0.05))
    one = monitor(whole, Reference(), {})
    for seed in range(3):
        shuffled = [*whole.measurements, *whole.measurements[100:200]]
        Random(seed).shuffle(shuffled)
        other = monitor(replace(whole, measurements=tuple(shuffled)), Reference(), {})
        assert one.values == other.values
        assert one.alarms == other.alarms


def test_a_baseline_that_is_known_is_not_fitted_again_and_changes_no_result() -> None:
    lived = history(QUIET, 24)
    whole = series(lived, sudden_loss(lived, 50, 0.08))
    earlier: Monitoring | None = None
    for events in (22, 23, 30, 45, 55, 80):
        known = series_until(whole, events)
        anew = monitor(known)
        again = monitor(known, earlier=None if earlier is None else earlier.baseline)
        assert (again.values, again.alarms) == (anew.values, anew.alarms)
        if earlier is not None and earlier.baseline is not None and not earlier.events_needed:
            assert again.baseline is earlier.baseline
        earlier = again
    assert earlier is not None
    assert earlier.baseline is not None
    assert earlier.alarms
    first = replace(whole.measurements[0], value=1.001 * whole.measurements[0].value)
    others = {
        "a measurement": monitor(
            replace(whole, measurements=(first, *whole.measurements[1:])), earlier=earlier.baseline
        ),
        "the reference": monitor(
            whole, Reference(end=whole.measurements[-1].time - timedelta(days=1)), earlier=earlier.baseline
        ),
    }
    assert [name for name, one in others.items() if one.baseline is earlier.baseline] == []


@pytest.mark.parametrize(("of_value", "of_amplitude"), [(1e3, 1.0), (1.0, 1e-2), (1e-6, 1e3)])
def test_units_change_nothing(of_value: float, of_amplitude: float) -> None:
    lived = history(Plan(events=60), 6)
    whole = series(lived, sudden_loss(lived, 40, 0.08))
    one, other = (monitor(s, Reference(), {}) for s in (whole, rescaled(whole, of_value, of_amplitude)))
    relative = 1e-6  # rounding, through the solution of the normal equations
    assert [v.value for v in other.values] == pytest.approx([v.value for v in one.values], rel=relative, abs=1e-9)
    assert [v.std for v in other.values] == pytest.approx([v.std for v in one.values], rel=relative)
    assert [(a.rule, a.onset, a.raised) for a in one.alarms] == [(a.rule, a.onset, a.raised) for a in other.alarms]


def test_without_a_baseline_the_number_of_events_needed_is_known() -> None:
    lived = history(Plan(events=30), 4)
    monitoring = monitor(series_until(series(lived), 4), Reference(), {})
    assert monitoring.baseline is None
    assert monitoring.events_needed == 16
    assert monitoring.values == monitoring.alarms == ()
    assert monitor(Series("stiffness", "x", ()), Reference(), {}).events_needed == 20


def test_a_reference_may_be_chosen() -> None:
    lived = history(QUIET, 29)
    whole = series(lived, sudden_loss(lived, 30, 0.08))
    times = [value.time for value in monitor(whole, Reference(), {}).values]
    after = monitor(whole, Reference(times[30], times[59]), {})
    assert after.baseline is not None
    assert after.baseline.events == tuple(range(30, 60))
    assert not after.alarms, "events before the reference are not tested, and nothing changed after it"
    assert np.mean([value.value for value in after.values[:30]]) > 0.06
    before = monitor(whole, Reference(None, times[29] + timedelta(seconds=1)), {})
    assert sure(before)[0].onset == 30


def test_an_unknown_quantity_is_refused() -> None:
    with pytest.raises(ModelError, match="stiffness"):
        monitor(Series("colour", "x", ()), Reference(), {})


@pytest.mark.accuracy
def test_the_false_alarms_are_as_stated() -> None:
    """At 5 %, 8 or more of 60 healthy histories of 100 events have a probability of 1 % (binomial)."""
    plan = Plan(events=121)
    assert sum(bool(sure(monitored(history(plan, 10_001 + 2 * n)))) for n in range(60)) < 8


@pytest.mark.parametrize(
    ("size", "most"),
    [
        (0.08, 2),
        (0.04, 6),
    ],  # events, of the median: from 200 random histories in docs/operate/drift.md, and half as many more
    ids=["8 %", "4 %"],
)
def test_the_onset_interval_contains_the_beginning_of_the_change(size: float, most: int) -> None:
    """From the last event that did not show the change to the first that did."""
    contained, lengths = [], []
    for seed in range(300, 320):
        lived = history(Plan(events=80, giant=False), seed)
        alarm = next(one for one in sure(monitored(lived, sudden_loss(lived, 50, size))) if one.drift < 0)
        assert alarm.after < alarm.onset <= alarm.by <= alarm.raised
        contained.append(alarm.after < 50 <= alarm.by)
        lengths.append(alarm.by - alarm.after)
    assert sum(contained) >= 18  # of 20 with 95 % each: fewer in one of 13 trials
    assert np.median(lengths) <= most


@pytest.mark.parametrize("early", [0, 1, 2])
def test_the_onset_interval_reaches_into_the_reference(early: int) -> None:
    """The events of the reference are not tested, but the last of them may show the change."""
    lived = history(QUIET, 10)
    last = max(value.event for value in monitored(lived).values if value.is_reference)
    onset = last + 1 - early
    monitoring = monitored(lived, sudden_loss(lived, onset, 0.08))
    alarm = sure(monitoring)[0]
    assert {value.event for value in monitoring.values if value.is_reference} >= {last}
    assert alarm.after < onset <= alarm.by == last + 1
    assert onset - alarm.after <= 2
