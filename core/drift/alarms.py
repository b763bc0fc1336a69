"""Which changes do the rules find in a series' deviations, one after the other?

A change that was found is from then on a nuisance: its pattern joins the covariance with a size that is not known, so
that what follows is judged against the level it left.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from core.arrays import Matrix, Vector
from core.drift.alarm import Alarm
from core.drift.baseline import Baseline
from core.drift.event_value import relative
from core.drift.points import Dated, Points
from core.drift.rules import SLOW, WITHIN, WITHIN_RATE, Rule, ramps, rules, steps
from core.drift.sequential import CLIP, LOCATING_CLIP, Change, Innovations, change, evidence, innovations
from core.drift.watched import Quantity
from core.drift.within import contrasts, damage
from core.drift.words import message, message_within

GATHERING = -0.7
"""Standard deviations from a rule's threshold at which its evidence is told while it gathers."""
NUISANCE = 0.5
"""Standard deviation of the size of a change that is known to be there; relative."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """Where a rule's evidence reached its threshold."""

    rule: Rule
    onset: int
    raised: int
    is_firing: bool


def alarms(
    known: Quantity, baseline: Baseline, dated: Sequence[Dated], deviation: Vector, shared: Matrix
) -> tuple[Alarm, ...]:
    """Of a series, in the order in which they were raised.

    Args:
        known: the quantity.
        baseline: of the series.
        dated: n events that are judged, in order of time.
        deviation: (n,) of each.
        shared: (n, n) their covariance while the building is healthy.
    """
    crossings: list[tuple[Crossing, Innovations]] = []
    start = 0
    while start < deviation.size:
        white = innovations(deviation, shared, baseline.scatter.freedom, CLIP)
        senses = [crossing.rule.sense for crossing, _ in crossings]
        crossing = _crossing(white, rules(known, senses), start)
        if crossing is None:
            break
        crossing = _located(crossing, innovations(deviation, shared, baseline.scatter.freedom, LOCATING_CLIP), start)
        crossings.append((crossing, white))
        if not crossing.is_firing:
            break
        shared = shared + _nuisance(crossing, deviation.size, baseline)
        start = crossing.raised + 1
    ends = [*(crossing.onset for crossing, _ in crossings[1:]), deviation.size]
    return tuple(
        _alarm(crossing, white, end, baseline, dated) for (crossing, white), end in zip(crossings, ends, strict=False)
    )


def alarms_within(
    known: Quantity, baseline: Baseline, points: Points, dated: Sequence[Dated], judged: Sequence[int]
) -> tuple[Alarm, ...]:
    """Of damage that single events show in themselves; of quantities whose cycles can be compared.

    Args:
        known: the quantity.
        baseline: of the series.
        points: all that was observed.
        dated: its events.
        judged: which of them are judged.
    """
    if not known.follows_amplitude or known.harm != "less":
        return ()
    every = contrasts(points, len(dated), baseline)
    reference = set(baseline.events)
    healthy = [one for one, when in zip(every, dated, strict=True) if one is not None and when.event in reference]
    raised = []
    for n in judged:
        one = every[n]
        lost = None if one is None else damage(one, healthy, known.scatter)
        if lost is not None:
            raised.append(_alarm_within(lost, dated[n], baseline))
    return tuple(raised)


def _alarm_within(lost: Change, when: Dated, baseline: Baseline) -> Alarm:
    drift, low, high = (relative(value, baseline) for value in (lost.size, lost.low, lost.high))
    return Alarm(
        rule=WITHIN,
        is_firing=True,
        onset=when.event,
        raised=when.event,
        events=(when.event,),
        drift=drift,
        low=low,
        high=high,
        false_alarms=WITHIN_RATE,
        causes=(),
        message=message_within(baseline.design.quantity, when.time, drift, low, high),
    )


def _crossing(white: Innovations, looked_for: Sequence[Rule], start: int) -> Crossing | None:
    """The first; of rules that are sure at the same event the surest; else what gathers at the latest event."""
    best: tuple[int, float, Crossing] | None = None
    last = white.raw.size - 1
    for rule in looked_for:
        root, speaking = evidence(white, rule.pattern(white.raw.size), rule.sense)
        root[:, :start] = 0.0
        sure = np.where(speaking >= rule.speaking, root, 0.0)
        reached = np.flatnonzero(sure[start:].max(axis=1) >= rule.threshold)
        now = start + int(reached[0]) if reached.size else last
        weighed = sure if reached.size else root
        onset = int(weighed[now].argmax())
        excess = float(weighed[now, onset]) - rule.threshold
        if excess < GATHERING:
            continue
        rank = (now if reached.size else last + 1, -excess)
        if best is None or rank < best[:2]:
            best = (*rank, Crossing(rule, onset, now, bool(reached.size)))
    return None if best is None else best[2]


def _located(crossing: Crossing, white: Innovations, start: int) -> Crossing:
    """With the likeliest onset, large deviations counting nearly in full."""
    rule = crossing.rule
    root, speaking = evidence(white, rule.pattern(white.raw.size), rule.sense)
    enough = speaking[crossing.raised] >= (rule.speaking if crossing.is_firing else 1)
    enough[:start] = False
    onset = int(np.where(enough, root[crossing.raised], -1.0).argmax())
    return replace(crossing, onset=onset)


def _nuisance(crossing: Crossing, count: int, baseline: Baseline) -> Matrix:
    """(count, count) covariance of a change of unknown size; a slow one may also end, or go on, at any pace."""
    known = [steps(count)[:, crossing.onset]]
    if crossing.rule.name == SLOW:
        slopes = ramps(count)
        known += [slopes[:, crossing.onset], *([slopes[:, crossing.raised + 1]] if crossing.raised + 1 < count else [])]
    columns = NUISANCE * baseline.design.size * np.array(known)
    return np.asarray(columns.T @ columns)


def _alarm(crossing: Crossing, white: Innovations, end: int, baseline: Baseline, dated: Sequence[Dated]) -> Alarm:
    """With everything that was measured until the next change."""
    until = Innovations(white.lower[:end, :end], white.clipped[:end], white.raw[:end], white.freedom)
    pattern = crossing.rule.pattern(end)[:, crossing.onset]
    size = change(until, pattern)
    drift, low, high = (relative(float(pattern[-1]) * value, baseline) for value in (size.size, size.low, size.high))
    return Alarm(
        rule=crossing.rule.name,
        is_firing=crossing.is_firing,
        onset=dated[crossing.onset].event,
        raised=dated[crossing.raised].event,
        events=tuple(one.event for one in dated[crossing.onset : crossing.raised + 1]),
        drift=drift,
        low=low,
        high=high,
        false_alarms=crossing.rule.false_alarms,
        causes=(),
        message=message(baseline.design.quantity, crossing.rule, dated[crossing.onset].time, drift, low, high),
    )
