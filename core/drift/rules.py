"""Rules for a change over several events: their patterns, their test statistics, and the posterior of the onset.

A rule looks for one pattern of deviations: a step for a sudden change, a ramp for a slow one, a step back for a
recovery. Its statistic is the signed root of twice the log likelihood ratio (`core.drift.change_statistics`).

Every onset of a change has the likelihood ratio of its pattern, the size integrated out under a normal prior; all
onsets are equally likely beforehand (Smith, 1975; Barry and Hartigan, 1993). Rules of one sign share the posterior,
because a small sudden loss and the beginning of a slow one are hard to distinguish.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Mask, Matrix, Vector
from core.drift.change_statistics import CLIP, Innovations, ReferenceDeviations, signed_roots, whitened
from core.drift.quantities import Quantity

SUDDEN, SLOW, RECOVERY = "sudden", "slow", "recovery"
"""Names of the rules, as stored."""
SUPPORTING, SUPPORTING_SLOPE = 2, 4
"""Events that must each support a step, and a ramp: one event alone never raises an alarm.
A choice; the rates below hold with it."""
SUDDEN_THRESHOLD, SLOW_THRESHOLD, RECOVERY_THRESHOLD = 3.85, 3.85, 4.1
"""Chosen on the even seeds of benchmarks/drift.py for false alarms of 5 % by all rules together."""
SUDDEN_RATE, SLOW_RATE, RECOVERY_RATE = 0.05, 0.005, 0.035
"""False alarms, measured on the odd seeds of benchmarks/drift.py and rounded (docs/operate/drift.md). Most false
recoveries follow a false loss."""
ONSET_LEVEL = 0.95
"""Posterior probability of an onset interval; docs/operate/drift.md says how often the interval contains the truth."""
ONSET_SIZE = 0.2
"""Prior standard deviation of the size of a change; relative. A choice; docs/operate/drift.md has the coverage of the
intervals that it leads to."""


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
        earlier: signs of the changes found so far, in order of time. Where either sign is harmful, a change back is a
            recovery.
    """
    harmful = {"less": (-1,), "more": (1,), "either": (-1, 1)}[known.harm]
    found = []
    for sign in (-1, 1):
        is_return = sign not in harmful or (bool(earlier) and known.harm == "either" and sign == -earlier[-1])
        if is_return:
            found.append(Rule(RECOVERY, steps, sign, SUPPORTING, RECOVERY_THRESHOLD, RECOVERY_RATE))
        else:
            found.append(Rule(SUDDEN, steps, sign, SUPPORTING, SUDDEN_THRESHOLD, SUDDEN_RATE))
            found.append(Rule(SLOW, ramps, sign, SUPPORTING_SLOPE, SLOW_THRESHOLD, SLOW_RATE))
    return tuple(found)


def rule_statistics(white: Innovations, rule: Rule, start: int) -> Matrix:
    """(n, onsets) statistic of a rule, by the latest event and the onset; 0 where too few events support the change.

    Args:
        white: innovations of n events.
        rule: the rule.
        start: earliest onset that is allowed.
    """
    root, supporting = signed_roots(white, rule.pattern(white.raw.size), rule.sign)
    return np.where((supporting >= rule.supporting) & _is_allowed(white.raw.size, start), root, 0.0)


def pending_statistics(white: Innovations, rule: Rule, start: int) -> Vector:
    """(onsets,) statistic of a rule at the latest event, where one event at least supports the change."""
    root, supporting = signed_roots(white, rule.pattern(white.raw.size), rule.sign)
    return np.where((supporting[-1] >= 1) & _is_allowed(white.raw.size, start), root[-1], 0.0)


def onset_interval(white: Innovations, rules: Sequence[Rule], scale: float, first: int, last: int) -> tuple[int, int]:
    """The shortest run of onsets with a posterior probability of `ONSET_LEVEL`.

    Args:
        white: innovations of the events whose evidence counts.
        rules: kinds of change that are possible.
        scale: unit of the sizes of changes, 1 for a logarithm.
        first: earliest onset that is possible.
        last: latest onset that is possible.

    Returns:
        The earliest and the latest onset of the run, both included.
    """
    logarithm = np.array([_log_posterior(white, rule, scale)[first : last + 1] for rule in rules])
    weight = np.exp(logarithm - logarithm.max()).sum(axis=0)
    share = np.concatenate([[0.0], np.cumsum(weight / weight.sum())])
    ends = np.searchsorted(share, share[:-1] + ONSET_LEVEL - 1e-12)
    possible = np.flatnonzero(ends < share.size)
    start = int(possible[(ends[possible] - possible).argmin()])
    return first + start, first + int(ends[start]) - 1


def changed_reference_events(reference: ReferenceDeviations, size: float) -> int:
    """Number of events at the end of the reference that may already show a sudden change of this size.

    The reference is not tested, and a change that began in its last events shows from the first tested event on. Each
    of these events counts for or against the change by its likelihood, clipped; with a probability of `ONSET_LEVEL`
    no more events show it.
    """
    deviation = np.clip(reference.deviation[::-1] / reference.std[::-1], -CLIP, CLIP)
    shift = size / reference.std[::-1]
    odds = np.concatenate([[0.0], np.cumsum((deviation**2 - (deviation - shift) ** 2) / 2)])
    share = np.exp(odds - odds.max())
    return int(np.searchsorted(np.cumsum(share / share.sum()), ONSET_LEVEL))


def _log_posterior(white: Innovations, rule: Rule, scale: float) -> Vector:
    """(onsets,) log posterior up to a constant common to all rules, with the size integrated out."""
    patterns = rule.pattern(white.raw.size)
    root, _ = signed_roots(white, patterns, rule.sign)
    length = (whitened(white, patterns) ** 2).sum(axis=0) * (ONSET_SIZE * scale) ** 2
    return np.asarray(root[-1] ** 2 / 2 - np.log1p(length) / 2)


def _is_allowed(count: int, start: int) -> Mask:
    return np.asarray(np.arange(count) >= start)
