"""Which changes are looked for, and how sure must one be?"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix
from core.drift.quantities import Quantity

SUDDEN, SLOW, RECOVERY, WITHIN = "sudden", "slow", "recovery", "within"


def steps(count: int) -> Matrix:
    """(count, onsets) a change by one that begins at an event and stays."""
    event = np.arange(count)
    return np.asarray(np.where(event[:, None] >= event[None, :], 1.0, 0.0))


def ramps(count: int) -> Matrix:
    """(count, onsets) a change that begins at an event and grows by one with each."""
    event = np.arange(count)
    return np.asarray(np.maximum(0.0, event[:, None] - event[None, :] + 1.0))


@dataclass(frozen=True, slots=True)
class Rule:
    """One kind of change over several events."""

    name: str
    pattern: Callable[[int], Matrix]
    sense: int
    """-1: a fall, +1: a rise."""
    speaking: int
    """Events that must each speak for the change."""
    threshold: float
    """Of the signed root of twice the log likelihood ratio, as many standard deviations."""
    false_alarms: float
    """Share of sequences of 100 healthy events in which the rule alarms."""


SPEAKING, SPEAKING_OF_A_SLOPE = 2, 4
SUDDEN_THRESHOLD, SLOW_THRESHOLD, RECOVERY_THRESHOLD = 3.85, 3.85, 4.1
"""Chosen on the even seeds of benchmarks/drift.py for 5 % of all rules together."""
SUDDEN_RATE, SLOW_RATE, RECOVERY_RATE, WITHIN_RATE = 0.05, 0.005, 0.035, 0.003
"""As measured on its odd seeds, in docs/drift.md; most recoveries are from a loss that was told falsely."""


def rules(known: Quantity, alarmed: Sequence[int] = ()) -> tuple[Rule, ...]:
    """The rules of a quantity.

    Args:
        known: the quantity.
        alarmed: senses of the changes that are known by now, in order of time.
    """
    harmful = {"less": (-1,), "more": (1,), "either": (-1, 1)}[known.harm]
    found = []
    for sense in (-1, 1):
        is_return = sense not in harmful or (bool(alarmed) and known.harm == "either" and sense == -alarmed[-1])
        if is_return:
            found.append(Rule(RECOVERY, steps, sense, SPEAKING, RECOVERY_THRESHOLD, RECOVERY_RATE))
        else:
            found.append(Rule(SUDDEN, steps, sense, SPEAKING, SUDDEN_THRESHOLD, SUDDEN_RATE))
            found.append(Rule(SLOW, ramps, sense, SPEAKING_OF_A_SLOPE, SLOW_THRESHOLD, SLOW_RATE))
    return tuple(found)
