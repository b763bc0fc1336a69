"""Alarms: the changes that the rules find in a sequence of deviations, one after the other, and their onsets.

Once a change is detected, its pattern joins the covariance with an unknown size, so that later events are tested
against the level that it left.

The onset is given as the interval of events that holds it, from its posterior. Every onset of a change has the
likelihood ratio of its pattern, the size integrated out under a normal prior; all onsets are equally likely beforehand
(Smith, 1975; Barry and Hartigan, 1993). Rules of one sign share the posterior, because a small sudden loss and the
beginning of a slow one are hard to distinguish.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from core import rounding
from core.arrays import Matrix, Vector
from core.drift.baseline import Baseline
from core.drift.change_statistics import (
    CLIP,
    LOCATING_CLIP,
    DeviationSequence,
    Innovations,
    ReferenceDeviations,
    change_size,
    first_innovations,
    signed_roots,
    whitened,
)
from core.drift.deviations import relative_change
from core.drift.quantities import Quantity
from core.drift.rules import (
    PENDING_MARGIN,
    RECOVERY,
    SLOW,
    SUDDEN,
    Rule,
    ramps,
    rule_roots,
    rules,
    steps,
)
from core.drift.screening import screened

HINDSIGHT = 10
"""Events after an alarm was raised that still decide which kind it is and where it began. A choice."""
NUISANCE_STD = 0.5
"""Prior standard deviation of the size of a detected change; relative. Wide, so that the later events alone
decide the level that the change left."""
ONSET_LEVEL = 0.95
"""Posterior probability of an onset interval; docs/operate/drift.md has its measured coverage."""
ONSET_SIZE = 0.2
"""Prior standard deviation of the size of a change; relative. A choice; docs/operate/drift.md has the coverage of the
intervals that it leads to."""
CHANGED: Mapping[str, str] = {
    SUDDEN: "the {title} has changed by {change}, beginning between the events of {span}",
    SLOW: "the {title} has changed by {change}, gradually, beginning between the events of {span}",
    RECOVERY: "the {title} has changed by {change}, as a recovery, beginning between the events of {span}",
}
"""One sentence without a full stop, by rule."""
SPAN = "{after:%Y-%m-%d %H:%M} and {by:%Y-%m-%d %H:%M} UTC"


@dataclass(frozen=True, slots=True)
class Alarm:
    """A change that a rule detected. Events are identified as in the series."""

    rule: str
    """`sudden`, `slow`, `recovery` or `within` (damage within one event)."""
    is_sure: bool
    """False while the alarm is pending."""
    onset: int
    """Event with which the change most likely began."""
    after: int
    """Last event that did not show the change, with 95 %; the event itself for damage within one event."""
    by: int
    """First event that showed it, with 95 %; the event itself for damage within one event."""
    raised: int
    """Event at which the alarm was raised; the latest event if it is pending."""
    events: tuple[int, ...]
    """Events whose evidence raised it, among those that the rule tested, with the onset."""
    drift: float
    """Relative change, -0.08 for 8 % less; in SI units where the logarithm is not monitored. For a slow change, up to
    the last event before the next change."""
    low: float
    """Lower end of the 95 % interval of the drift, given the onset."""
    high: float
    """Upper end of that interval."""
    false_alarms: float
    """Share of sequences of 100 healthy events in which the rule raises an alarm."""
    causes: tuple[str, ...]
    """Possible causes other than a change of the building, for people."""
    message: str
    """One sentence for an engineer."""


@dataclass(frozen=True, slots=True)
class Crossing:
    """Statistic of a rule at its threshold; events as indices into the tested ones."""

    rule: Rule
    onset: int
    """Event with which the change most likely began."""
    first: int
    """First of the events whose evidence raised the alarm."""
    raised: int
    """Event at which the statistic reached the threshold, or the latest event."""
    is_sure: bool
    """True if it reached the threshold."""
    earliest: int
    """First event with which the change may have begun."""
    latest: int
    """Last event with which the change may have begun."""


@dataclass(frozen=True, slots=True, eq=False)
class Judgement:
    """Result of the rules over several events."""

    alarms: tuple[Alarm, ...]
    """In the order in which they were raised."""
    seen: Vector | None
    """(n,) deviations as the rules saw them, with clipped innovations; None if a change is sure."""


def judged(known: Quantity, baseline: Baseline, tested: DeviationSequence, before: Vector | None) -> Judgement:
    """The rules applied to deviations of which the first were judged before.

    Args:
        known: the quantity.
        baseline: baseline of the series.
        tested: n deviations.
        before: (k,) `seen` of the first k of them; None where it is not known. It saves time and changes no result.
    """
    quiet = None if before is None else screened(known, tested, before)
    if quiet is not None:
        return Judgement((), quiet)
    found = alarms(known, baseline, tested)
    if any(one.is_sure for one in found) or not tested.deviation.size:
        return Judgement(found, None)
    white = tested.innovations()
    return Judgement(found, white.lower @ white.clipped)


def alarms(known: Quantity, baseline: Baseline, tested: DeviationSequence) -> tuple[Alarm, ...]:
    """Alarms of the rules over several events, in the order in which they were raised.

    Args:
        known: the quantity.
        baseline: baseline of the series.
        tested: the deviations that the rules test.
    """
    crossings: list[tuple[Crossing, Innovations]] = []
    start, left = 0, tested
    while start < tested.deviation.size:
        signs = [crossing.rule.sign for crossing, _ in crossings]
        white, possible = left.innovations(), rules(known, signs)
        crossing = _crossing(white, possible, start)
        if crossing is None:
            break
        crossing = _located(crossing, left.innovations(LOCATING_CLIP), possible, start, baseline)
        crossings.append((crossing, white))
        if not crossing.is_sure:
            break
        left = replace(left, common=np.hstack([left.common, _nuisance(crossing, tested.deviation.size, baseline)]))
        start = crossing.raised + 1
    following = [crossing.onset for crossing, _ in crossings[1:]]
    ends = [*following, tested.deviation.size][: len(crossings)]
    return tuple(
        _alarm(crossing, white, end, baseline, tested) for (crossing, white), end in zip(crossings, ends, strict=True)
    )


def printed_change(known: Quantity, drift: float, low: float, high: float) -> str:
    """A change with its interval, as in "−8.1 % (95 %: −9.9 to −6.2 %)"."""
    scale, unit = (100.0, "%") if known.is_logarithmic else (1000.0, "mm")
    return rounding.interval(scale * drift, scale * low, scale * high, unit)


def _crossing(white: Innovations, possible: Sequence[Rule], start: int) -> Crossing | None:
    """The first crossing; of rules that cross at the same event the surest; else a pending one at the latest event."""
    every = rule_roots(white, possible)
    margins = [(one.rule, one.statistics(start) - one.rule.threshold) for one in every]
    reached = [
        int(np.flatnonzero(surest >= 0)[0]) for _, excess in margins if (surest := excess.max(axis=1)).max() >= 0
    ]
    if reached:
        now = min(reached)
        rule, excess = max(margins, key=lambda pair: float(pair[1][now].max()))
        onset = int(excess[now].argmax())
        return Crossing(rule, onset, onset, now, True, onset, onset)
    last = [(one.rule, one.pending(start) - one.rule.threshold) for one in every]
    rule, pending = max(last, key=lambda pair: float(pair[1].max()))
    if pending.max() < PENDING_MARGIN:
        return None
    onset = int(pending.argmax())
    return Crossing(rule, onset, onset, white.raw.size - 1, False, onset, onset)


def _located(
    crossing: Crossing, white: Innovations, possible: Sequence[Rule], start: int, baseline: Baseline
) -> Crossing:
    """The crossing with the kind and onset that are likeliest in hindsight.

    A slow loss begins like a small sudden one: only later events distinguish them. `white` clips less than the
    innovations that raised the alarm, so that large deviations locate the onset.
    """
    seen = min(white.raw.size - 1, crossing.raised + HINDSIGHT)
    alike = [crossing.rule]
    if crossing.is_sure:
        alike = [rule for rule in possible if rule.sign == crossing.rule.sign]
    likely: list[tuple[Rule, Vector]] = [
        (one.rule, one.statistics(start)[seen, : crossing.raised + 1] if crossing.is_sure else one.pending(start))
        for one in rule_roots(white, alike)
    ]
    rule, statistic = max(likely, key=lambda pair: float(pair[1].max()))
    if statistic.max() == 0.0:
        return crossing
    onset = int(statistic.argmax())
    scale = baseline.model.size
    earliest, latest = _onset_interval(first_innovations(white, seen + 1), alike, scale, start, crossing.raised)
    return replace(crossing, rule=rule, onset=onset, earliest=min(earliest, onset), latest=max(latest, onset))


def _nuisance(crossing: Crossing, count: int, baseline: Baseline) -> Matrix:
    """(count, errors) a change of unknown size, by one standard deviation; a slow one may also end, or go on, at any
    pace."""
    known = [steps(count)[:, crossing.onset]]
    if crossing.rule.name == SLOW:
        slopes = ramps(count)
        known += [slopes[:, crossing.onset], *([slopes[:, crossing.raised + 1]] if crossing.raised + 1 < count else [])]
    return np.asarray(NUISANCE_STD * baseline.model.size * np.array(known).T)


def _alarm(crossing: Crossing, white: Innovations, end: int, baseline: Baseline, tested: DeviationSequence) -> Alarm:
    """The alarm of a crossing, its size from all events until the next change."""
    events, known = tested.events, baseline.model.quantity
    by = events[crossing.latest]
    pattern = crossing.rule.pattern(end)[:, crossing.onset]
    size = change_size(first_innovations(white, end), pattern)
    if crossing.earliest > 0:
        after = events[crossing.earliest - 1]
    else:
        back = 0 if crossing.rule.name == SLOW else _changed_reference_events(tested.reference, size.size)
        after = tested.reference.events[-1 - min(back, len(tested.reference.events) - 1)]
    drift, low, high = (
        relative_change(float(pattern[-1]) * value, baseline) for value in (size.size, size.low, size.high)
    )
    return Alarm(
        rule=crossing.rule.name,
        is_sure=crossing.is_sure,
        onset=events[crossing.onset].event,
        after=after.event,
        by=by.event,
        raised=events[crossing.raised].event,
        events=tuple(one.event for one in events[min(crossing.first, crossing.onset) : crossing.raised + 1]),
        drift=drift,
        low=low,
        high=high,
        false_alarms=crossing.rule.false_alarms,
        causes=(),
        message=_message(crossing.rule, printed_change(known, drift, low, high), known, after.time, by.time),
    )


def _message(rule: Rule, change: str, known: Quantity, after: datetime, by: datetime) -> str:
    """One sentence with the change, its interval and the events between which it began."""
    return CHANGED[rule.name].format(title=known.title, change=change, span=SPAN.format(after=after, by=by))


def _onset_interval(white: Innovations, kinds: Sequence[Rule], scale: float, first: int, last: int) -> tuple[int, int]:
    """The shortest run of onsets with a posterior probability of `ONSET_LEVEL`.

    Args:
        white: innovations of the events whose evidence counts.
        kinds: of change that are possible.
        scale: unit of the sizes of changes, 1 for a logarithm.
        first: earliest onset that is possible.
        last: latest onset that is possible.

    Returns:
        The earliest and the latest onset of the run, both included.
    """
    logarithm = np.array([_log_posterior(white, rule, scale)[first : last + 1] for rule in kinds])
    weight = np.exp(logarithm - logarithm.max()).sum(axis=0)
    share = np.concatenate([[0.0], np.cumsum(weight / weight.sum())])
    ends = np.searchsorted(share, share[:-1] + ONSET_LEVEL - 1e-12)
    possible = np.flatnonzero(ends < share.size)
    start = int(possible[(ends[possible] - possible).argmin()])
    return first + start, first + int(ends[start]) - 1


def _changed_reference_events(reference: ReferenceDeviations, size: float) -> int:
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
