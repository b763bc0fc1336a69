"""Detection delays and false alarms of the drift rules on one random history."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the generator is the tests'

import numpy as np
from drift_histories import Plan, gradual_loss, history, other_direction, series, sudden_loss

from core.arrays import Vector
from core.drift.alarms import Alarm, alarms
from core.drift.change_statistics import DeviationSequence
from core.drift.monitor import Monitoring, Reference, monitor
from core.drift.pooled import pooled_alarms
from core.drift.quantities import quantity
from core.drift.rules import SLOW, SUDDEN, rule_statistics, rules

HEALTHY = 100
"""Events after the reference in which false alarms are counted."""
EARLIEST, LATEST = 40, 100
"""Event with which a change begins."""
REPAIRED = 15
"""Events from a loss until its repair."""
SHARED = 0.3
"""Correlation of the scatter of two directions."""
FIRST_REFERENCE = 20
"""Events of nearly every reference."""
WITHIN: Mapping[str, tuple[str, int]] = MappingProxyType(
    {
        "5 % within 2 events": ("5 %", 2),
        "5 % within 3 events": ("5 %", 3),
        "2 % within 10 events": ("2 %", 10),
        "0.5 % an event within 12 events": ("slow", 12),
    }
)
"""Curves of the pictures: the change, and the number of events within which it has to be found."""


@dataclass(frozen=True, slots=True, eq=False)
class Trial:
    """Alarms on one history; delays in events, None without an alarm."""

    healthy: frozenset[str]
    """Rules that raised a false alarm in a hundred healthy events."""
    found: Mapping[str, int | None]
    """Delay of the alarm on each loss, by change."""
    repair: int | None
    """Delay of the alarm on the repair of an 8 % loss."""
    is_covered: bool | None
    """True if the interval of the 5 % loss contains 5 %; None without an alarm on a sudden loss."""
    highest: float
    """Largest statistic of a loss in a hundred healthy events."""
    strongest: Mapping[str, float]
    """Largest statistic in the events within which a change has to be found, by WITHIN."""


def trial(plan: Plan, seed: int) -> Trial:
    """One history, healthy and with each change."""
    lived = history(plan, seed)
    healthy = monitor(series(lived), Reference(), {})
    onset = onset_after(seed, healthy)
    lost, mended = sudden_loss(lived, onset, 0.08), sudden_loss(lived, onset + REPAIRED, 0.08)
    changed = {
        "5 %": with_change(healthy, sudden_loss(lived, onset, 0.05)),
        "2 %": with_change(healthy, sudden_loss(lived, onset, 0.02)),
        "slow": with_change(healthy, gradual_loss(lived, onset, 0.005)),
        "8 %": with_change(healthy, lost - mended),
    }
    raised = {name: alarms_on(healthy, one) for name, one in changed.items()}
    last = max(n for n, value in enumerate(healthy.values) if value.is_reference) + HEALTHY
    strength = {name: loss_statistics(one) for name, one in changed.items()}
    return Trial(
        healthy=frozenset(one.rule for one in healthy.alarms if one.is_sure and one.raised <= last),
        found={name: events_until(losses(alarms), onset) for name, alarms in raised.items()},
        repair=events_until(recoveries(raised["8 %"]), onset + REPAIRED),
        is_covered=is_covered(losses(raised["5 %"]), onset, -0.05),
        highest=max((value for event, value in loss_statistics(tested(healthy)).items() if event <= last), default=0.0),
        strongest={
            label: max((strength[name].get(onset + n, 0.0) for n in range(count)), default=0.0)
            for label, (name, count) in WITHIN.items()
        },
    )


def onset_after(seed: int, *healthy: Monitoring) -> int:
    """A random onset after the references."""
    last = max(value.event for one in healthy for value in one.values if value.is_reference)
    return max(last + 1, int(np.random.default_rng([seed, 1]).integers(EARLIEST, LATEST)))


def tested(found: Monitoring) -> DeviationSequence:
    if found.tested is None:
        raise ValueError("a history of so many events has a baseline")
    return found.tested


def with_change(healthy: Monitoring, change: Vector) -> DeviationSequence:
    """The tested deviations after a change of the stiffness, the same for all cycles of an event.

    Args:
        healthy: monitoring of a history whose reference ends before the change begins.
        change: (events,) relative.
    """
    whole = tested(healthy)
    if any(change[value.event] for value in healthy.values if value.is_reference):
        raise ValueError("the reference must be healthy")
    shift = np.log1p(change[[one.event for one in whole.events]])
    return replace(whole, deviation=whole.deviation + shift)


def alarms_on(healthy: Monitoring, changed: DeviationSequence) -> tuple[Alarm, ...]:
    """Alarms of the rules over several events."""
    if healthy.baseline is None:
        raise ValueError("a history of so many events has a baseline")
    return alarms(quantity("stiffness"), healthy.baseline, changed)


def losses(alarms: Sequence[Alarm]) -> list[Alarm]:
    return [one for one in alarms if one.is_sure and one.drift < 0]


def recoveries(alarms: Sequence[Alarm]) -> list[Alarm]:
    return [one for one in alarms if one.is_sure and one.drift > 0]


@dataclass(frozen=True, slots=True)
class PooledTrial:
    """Alarms on the mean of both directions; delays in events, None without an alarm."""

    is_false: bool
    found: Mapping[str, int | None]


def trial_pooled(plan: Plan, seed: int) -> PooledTrial:
    """The same changes in both directions of one building."""
    lived = history(plan, seed)
    one, other = (
        monitor(series(side), Reference(), {}) for side in (lived, other_direction(plan, lived, seed, SHARED))
    )
    onset = onset_after(seed, one, other)
    changes = {
        "5 %": sudden_loss(lived, onset, 0.05),
        "2 %": sudden_loss(lived, onset, 0.02),
        "slow": gradual_loss(lived, onset, 0.005),
    }
    raised = {
        name: pooled_alarms(*(replace(side, tested=with_change(side, change)) for side in (one, other)))
        for name, change in changes.items()
    }
    last = FIRST_REFERENCE + HEALTHY
    return PooledTrial(
        any(alarm.is_sure and alarm.raised <= last for alarm in pooled_alarms(one, other)),
        {name: events_until(losses(alarms), onset) for name, alarms in raised.items()},
    )


@dataclass(frozen=True, slots=True)
class Dating:
    """Onset interval of a change."""

    contains: bool
    """True if it contains the beginning of the change."""
    length: int
    """Tested events from the last that did not show the change to the first that did."""


def trial_of_dating(plan: Plan, seed: int) -> Mapping[str, Dating]:
    """Onset interval of the first alarm after each change, by change; changes without an alarm are left out."""
    lived = history(plan, seed)
    healthy = monitor(series(lived), Reference(), {})
    onset = onset_after(seed, healthy)
    events = [one.event for one in tested(healthy).events]
    truth = next(n for n, event in enumerate(events) if event >= onset)
    found = {}
    for name, loss in {"8 %": 0.08, "5 %": 0.05, "2 %": 0.02, "slow": 0.005}.items():
        change = gradual_loss(lived, onset, loss) if name == "slow" else sudden_loss(lived, onset, loss)
        alarms = losses(alarms_on(healthy, with_change(healthy, change)))
        alarm = next((one for one in alarms if one.raised >= onset), None)
        if alarm is not None:
            after, by = (events.index(one) if one in events else -1 for one in (alarm.after, alarm.by))
            found[name] = Dating(after < truth <= by, by - after)
    return found


def events_until(alarms: Sequence[Alarm], onset: int) -> int | None:
    """Events from the first with the change, which counts as one, to the one that raised an alarm."""
    return next((alarm.raised - onset + 1 for alarm in alarms if alarm.raised >= onset), None)


def is_covered(alarms: Sequence[Alarm], onset: int, truth: float) -> bool | None:
    first = next((alarm for alarm in alarms if alarm.raised >= onset), None)
    return None if first is None or first.rule != SUDDEN else first.low <= truth <= first.high


def loss_statistics(sequence: DeviationSequence) -> Mapping[int, float]:
    """Largest statistic of the two rules for losses, by event, without regard to earlier alarms."""
    white = sequence.innovations()
    wanted = [rule for rule in rules(quantity("stiffness")) if rule.name in (SUDDEN, SLOW)]
    best: Vector = np.max([rule_statistics(white, rule, 0).max(axis=1) for rule in wanted], axis=0)
    return {one.event: float(value) for one, value in zip(sequence.events, best, strict=True)}
