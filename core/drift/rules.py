"""Rules for a change over several events: their patterns and test statistics.

A rule looks for one pattern of deviations: a step for a sudden change, a ramp for a slow one, a step back for a
recovery. Its statistic is the signed root of twice the log likelihood ratio (`core.drift.change_statistics`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Indices, Mask, Matrix, Vector
from core.drift.change_statistics import Innovations, response, roots_of_response
from core.drift.quantities import Quantity

SUDDEN, SLOW, RECOVERY = "sudden", "slow", "recovery"
"""Names of the rules, as stored."""
SUPPORTING, SUPPORTING_SLOPE = 2, 4
"""Events that must each support a step, and a ramp: one event alone never raises an alarm.
A choice; the rates below hold with it."""
SUDDEN_THRESHOLD, SLOW_THRESHOLD, RECOVERY_THRESHOLD = 3.85, 3.85, 4.1
"""Chosen on the even seeds of benchmarks/drift.py for false alarms of 5 % by all rules together."""
PENDING_MARGIN = -0.7
"""Standard deviations from a rule's threshold at which an alarm is pending; it sends no message. A choice."""
SUDDEN_RATE, SLOW_RATE, RECOVERY_RATE = 0.05, 0.005, 0.035
"""False alarms in 100 healthy events, about as measured on the odd seeds of benchmarks/drift.py; docs/operate/drift.md
compares them. Most false recoveries follow a false loss."""


def steps(count: int) -> Matrix:
    """(count, onsets) a change by one that begins at the onset and stays."""
    event = np.arange(count)
    return np.asarray(np.where(event[:, None] >= event[None, :], 1.0, 0.0))


def ramps(count: int) -> Matrix:
    """(count, onsets) a change that begins at the onset and grows by one with each event."""
    event = np.arange(count)
    return np.asarray(np.maximum(0.0, event[:, None] - event[None, :] + 1.0))


@dataclass(frozen=True, slots=True)
class Rule:
    """Test for one kind of change over several events."""

    name: str
    pattern: Callable[[int], Matrix]
    """`steps` or `ramps`."""
    sign: int
    """-1 for a fall, +1 for a rise."""
    supporting: int
    """Events that must each support the change."""
    threshold: float
    """Statistic at which the rule raises an alarm, standard deviations."""
    false_alarms: float
    """Share of sequences of 100 healthy events in which the rule raises an alarm."""


def rules(known: Quantity, earlier: Sequence[int] = ()) -> tuple[Rule, ...]:
    """The rules for a quantity.

    Args:
        known: the quantity.
        earlier: signs of the changes detected so far, in order of time. Where either sign is harmful, a change back is
            a recovery.
    """
    harmful = {"less": (-1,), "more": (1,), "either": (-1, 1)}[known.harm]
    possible = []
    for sign in (-1, 1):
        is_return = sign not in harmful or (bool(earlier) and known.harm == "either" and sign == -earlier[-1])
        if is_return:
            possible.append(Rule(RECOVERY, steps, sign, SUPPORTING, RECOVERY_THRESHOLD, RECOVERY_RATE))
        else:
            possible.append(Rule(SUDDEN, steps, sign, SUPPORTING, SUDDEN_THRESHOLD, SUDDEN_RATE))
            possible.append(Rule(SLOW, ramps, sign, SUPPORTING_SLOPE, SLOW_THRESHOLD, SLOW_RATE))
    return tuple(possible)


@dataclass(frozen=True, slots=True, eq=False)
class RuleRoots:
    """Signed roots of one rule for n events."""

    rule: Rule
    root: Matrix
    """(n, onsets) by the latest event and the onset."""
    supporting: Indices
    """(n, onsets) numbers of events that support the change."""

    def statistics(self, start: int) -> Matrix:
        """(n, onsets) statistic of the rule; 0 where too few events support the change, or before `start`."""
        return np.where((self.supporting >= self.rule.supporting) & self._is_allowed(start), self.root, 0.0)

    def pending(self, start: int) -> Vector:
        """(onsets,) statistic at the latest event, where one event at least supports the change."""
        return np.where((self.supporting[-1] >= 1) & self._is_allowed(start), self.root[-1], 0.0)

    def _is_allowed(self, start: int) -> Mask:
        return np.asarray(np.arange(self.root.shape[1]) >= start)


def rule_roots(white: Innovations, possible: Sequence[Rule]) -> tuple[RuleRoots, ...]:
    """Signed roots of some rules; the innovations' response to a pattern is found once for all rules that share it."""
    patterns = {rule.pattern for rule in possible}
    found = {pattern: response(white, pattern(white.raw.size)) for pattern in patterns}
    return tuple(RuleRoots(rule, *roots_of_response(white, found[rule.pattern], rule.sign)) for rule in possible)


def rule_statistics(white: Innovations, rule: Rule, start: int) -> Matrix:
    """(n, onsets) statistic of a rule, by the latest event and the onset; 0 where too few events support the change.

    Args:
        white: innovations of n events.
        rule: the rule.
        start: earliest onset that is allowed.
    """
    return rule_roots(white, (rule,))[0].statistics(start)
