"""The benchmark of drift: its short cut gives the full result, and its page keeps the parts that are not renewed."""

from collections.abc import Callable

import numpy as np
import pytest
from drift_histories import History, Plan, gradual_loss, history, series, sudden_loss

from benchmarks.drift import picture, renewed
from benchmarks.drift_trial import alarms_on, events_until, losses, trial, with_change
from core.arrays import Vector
from core.drift.monitor import Reference, monitor

PLAN = Plan(events=80)


@pytest.mark.parametrize("change", [sudden_loss, gradual_loss])
def test_a_change_of_all_cycles_is_one_of_their_mean(change: Callable[[History, int, float], Vector]) -> None:
    lived = history(PLAN, 3)
    lost = change(lived, 50, 0.01)
    short = alarms_on(healthy := monitor(series(lived), Reference(), {}), with_change(healthy, lost))
    whole = [alarm for alarm in monitor(series(lived, lost), Reference(), {}).alarms if alarm.rule != "within"]
    assert whole
    assert [(a.rule, a.onset, a.raised) for a in short] == [(a.rule, a.onset, a.raised) for a in whole]
    assert [a.drift for a in short] == pytest.approx([a.drift for a in whole], rel=1e-6)  # rounding


def test_a_change_in_the_reference_is_refused() -> None:
    healthy = monitor(series(history(PLAN, 3)), Reference(), {})
    with pytest.raises(ValueError, match="reference"):
        with_change(healthy, np.full(PLAN.events, -0.05))


def test_a_trial_counts_from_the_first_event_with_the_change() -> None:
    one = trial(Plan(events=130, scatter=(0.005, 0.005), outliers=0.0), 1)
    assert one.found["8 %"] in (1, 2, 3)
    assert one.repair is not None
    assert losses(()) == []
    assert events_until((), 5) is None
    assert picture("some", [one, one]).to_dict()["title"] == "some"


def test_a_page_keeps_what_is_not_renewed() -> None:
    page = "before <!-- one -->\nold\n<!-- /one --> after"
    assert renewed(page, "one", "new") == "before <!-- one -->\nnew\n<!-- /one --> after"
