from random import Random

import numpy as np
from drifting import History, Plan, cut, history, series, stepped

from core.drift.monitor import Monitoring, Reference, monitor


def monitored(lived: History, change: np.ndarray | None = None) -> Monitoring:
    return monitor(series(lived, change), Reference(), {})


def test_a_sudden_loss_alarms_with_the_event_it_began_with() -> None:
    lived = history(Plan(events=80, giant=False, outliers=0.0, scatter=(0.005, 0.01)), 3)
    alarm = monitored(lived, stepped(lived, 50, 0.08)).alarms[0]
    assert (alarm.rule, alarm.is_firing, alarm.onset) == ("sudden", True, 50)
    assert alarm.raised <= 52
    assert alarm.low < -0.08 < alarm.high


def test_few_events_are_no_baseline_and_say_how_many_are_wanted() -> None:
    lived = history(Plan(events=30), 4)
    found = monitor(cut(series(lived), 4), Reference(), {})
    assert found.baseline is None
    assert found.wanted == 16
    assert found.values == found.alarms == ()


def test_the_order_of_arrival_and_repetition_change_nothing() -> None:
    lived = history(Plan(events=60), 5)
    whole = series(lived, stepped(lived, 40, 0.05))
    shuffled = [*whole.observations, *whole.observations[100:200]]
    Random(5).shuffle(shuffled)
    one, other = (monitor(s, Reference(), {}) for s in (whole, type(whole)("stiffness", "x", tuple(shuffled))))
    assert one.values == other.values
    assert one.alarms == other.alarms
