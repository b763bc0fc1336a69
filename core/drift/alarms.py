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
from core.drift.dating import onset_interval, within_reference
from core.drift.event_value import relative
from core.drift.judged import Judged, gathering, strengths
from core.drift.quantities import Quantity
from core.drift.rules import SLOW, WITHIN, WITHIN_RATE, Rule, ramps, rules, steps
from core.drift.sequential import LOCATING_CLIP, Change, Innovations, change, until
from core.drift.series import SeriesArrays, SeriesEvent
from core.drift.within import contrasts, damage
from core.drift.words import message, message_within

GATHERING = -0.7
"""Standard deviations from a rule's threshold at which its evidence is told while it gathers."""
HINDSIGHT = 10
"""Events after an alarm was raised that still decide of which kind it is and where it began."""
NUISANCE = 0.5
"""Standard deviation of the size of a change that is known to be there; relative."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """Where a rule's evidence reached its threshold."""

    rule: Rule
    onset: int
    first: int
    """Of the events whose evidence raised it."""
    raised: int
    is_sure: bool
    earliest: int
    """First and"""
    latest: int
    """last event with which it may have begun."""


def alarms(known: Quantity, baseline: Baseline, judged: Judged) -> tuple[Alarm, ...]:
    """Of a series, in the order in which they were raised."""
    crossings: list[tuple[Crossing, Innovations]] = []
    start, left = 0, judged
    while start < judged.deviation.size:
        senses = [crossing.rule.sense for crossing, _ in crossings]
        white, looked_for = left.innovations(), rules(known, senses)
        crossing = _crossing(white, looked_for, start)
        if crossing is None:
            break
        crossing = _located(crossing, left.innovations(LOCATING_CLIP), looked_for, start, baseline)
        crossings.append((crossing, white))
        if not crossing.is_sure:
            break
        left = replace(left, covariance=left.covariance + _nuisance(crossing, judged.deviation.size, baseline))
        start = crossing.raised + 1
    following = [crossing.onset for crossing, _ in crossings[1:]]
    ends = [*following, judged.deviation.size][: len(crossings)]
    return tuple(
        _alarm(crossing, white, end, baseline, judged) for (crossing, white), end in zip(crossings, ends, strict=True)
    )


def alarms_within(
    known: Quantity, baseline: Baseline, points: SeriesArrays, dated: Sequence[SeriesEvent], judged: Sequence[int]
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


def _alarm_within(lost: Change, when: SeriesEvent, baseline: Baseline) -> Alarm:
    drift, low, high = (relative(value, baseline) for value in (lost.size, lost.low, lost.high))
    return Alarm(
        rule=WITHIN,
        is_sure=True,
        onset=when.event,
        after=when.event,
        by=when.event,
        raised=when.event,
        events=(when.event,),
        drift=drift,
        low=low,
        high=high,
        false_alarms=WITHIN_RATE,
        causes=(),
        message=message_within(baseline.model.quantity, when.time, drift, low, high),
    )


def _crossing(white: Innovations, looked_for: Sequence[Rule], start: int) -> Crossing | None:
    """The first; of rules that are sure at the same event the surest; else what gathers at the latest event."""
    found = [(rule, strengths(white, rule, start) - rule.threshold) for rule in looked_for]
    reached = [int(np.flatnonzero(surest >= 0)[0]) for _, excess in found if (surest := excess.max(axis=1)).max() >= 0]
    if reached:
        now = min(reached)
        rule, excess = max(found, key=lambda pair: float(pair[1][now].max()))
        onset = int(excess[now].argmax())
        return Crossing(rule, onset, onset, now, True, onset, onset)
    last = [(rule, gathering(white, rule, start) - rule.threshold) for rule in looked_for]
    rule, gathered = max(last, key=lambda pair: float(pair[1].max()))
    if gathered.max() < GATHERING:
        return None
    onset = int(gathered.argmax())
    return Crossing(rule, onset, onset, white.raw.size - 1, False, onset, onset)


def _located(
    crossing: Crossing, white: Innovations, looked_for: Sequence[Rule], start: int, baseline: Baseline
) -> Crossing:
    """With the kind and the onset that are likeliest by what came soon after, large deviations counting nearly in full.

    A slow loss begins like a small sudden one: only what follows tells them apart.
    """
    seen = min(white.raw.size - 1, crossing.raised + HINDSIGHT)
    likely: list[tuple[Rule, Vector]] = [(crossing.rule, gathering(white, crossing.rule, start))]
    alike = [crossing.rule]
    if crossing.is_sure:
        alike = [rule for rule in looked_for if rule.sense == crossing.rule.sense]
        likely = [(rule, strengths(white, rule, start)[seen, : crossing.raised + 1]) for rule in alike]
    rule, strength = max(likely, key=lambda pair: float(pair[1].max()))
    if strength.max() == 0.0:
        return crossing
    onset = int(strength.argmax())
    scale = baseline.model.size
    earliest, latest = onset_interval(until(white, seen + 1), alike, scale, start, crossing.raised)
    return replace(crossing, rule=rule, onset=onset, earliest=min(earliest, onset), latest=max(latest, onset))


def _nuisance(crossing: Crossing, count: int, baseline: Baseline) -> Matrix:
    """(count, count) covariance of a change of unknown size; a slow one may also end, or go on, at any pace."""
    known = [steps(count)[:, crossing.onset]]
    if crossing.rule.name == SLOW:
        slopes = ramps(count)
        known += [slopes[:, crossing.onset], *([slopes[:, crossing.raised + 1]] if crossing.raised + 1 < count else [])]
    columns = NUISANCE * baseline.model.size * np.array(known)
    return np.asarray(columns.T @ columns)


def _alarm(crossing: Crossing, white: Innovations, end: int, baseline: Baseline, judged: Judged) -> Alarm:
    """With everything that was measured until the next change."""
    dated = judged.dated
    by = dated[crossing.latest]
    pattern = crossing.rule.pattern(end)[:, crossing.onset]
    size = change(until(white, end), pattern)
    if crossing.earliest > 0:
        after = dated[crossing.earliest - 1]
    else:
        back = 0 if crossing.rule.name == SLOW else within_reference(judged.before, size.size)
        after = judged.before.dated[-1 - min(back, len(judged.before.dated) - 1)]
    drift, low, high = (relative(float(pattern[-1]) * value, baseline) for value in (size.size, size.low, size.high))
    return Alarm(
        rule=crossing.rule.name,
        is_sure=crossing.is_sure,
        onset=dated[crossing.onset].event,
        after=after.event,
        by=by.event,
        raised=dated[crossing.raised].event,
        events=tuple(one.event for one in dated[min(crossing.first, crossing.onset) : crossing.raised + 1]),
        drift=drift,
        low=low,
        high=high,
        false_alarms=crossing.rule.false_alarms,
        causes=(),
        message=message(baseline.model.quantity, crossing.rule, after.time, by.time, drift, low, high),
    )
