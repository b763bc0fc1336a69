"""Do several series of one building change together: a layer that is damaged softens in every direction?

What scatters from event to event is only in part common to the directions, so that their mean tells a common loss
sooner than any one of them.
"""

import numpy as np

from core.arrays import Indices
from core.drift.alarm import Alarm
from core.drift.alarms import alarms
from core.drift.causes import with_causes
from core.drift.event_value import EventValue
from core.drift.judged import Before, Judged
from core.drift.monitor import Monitoring
from core.drift.quantities import Quantity, quantity
from core.drift.series import Series
from core.errors import ModelError

BOTH = "xy"
"""Name of what both directions of the layer tell by their mean."""
COMMON = 0.5
"""Correlation of the directions' scatter that is believed beforehand."""
BELIEVED = 10.0
"""Events that the belief counts for."""


def together(one: Monitoring, other: Monitoring, subject: str) -> Monitoring:
    """The mean of two series as one of its own: it has no curve, for each of the two is held against its own.

    Args:
        one: of a direction.
        other: of the other.
        subject: name of what both are of.

    Raises:
        ModelError: they are of different quantities.
    """
    known, values = quantity(one.series.quantity), mean_values(one, other)
    causes = {value.event: value.causes for value in values}
    return Monitoring(
        series=Series(known.name, subject, ()),
        baseline=None,
        wanted=max(one.wanted, other.wanted),
        values=values,
        alarms=tuple(with_causes(alarm, known, causes) for alarm in alarms_together(one, other)),
    )


def mean_values(one: Monitoring, other: Monitoring) -> tuple[EventValue, ...]:
    """Of each event that both series have, what the rules judge by their mean; in order of time."""
    known, common = quantity(one.series.quantity), correlation(one, other)
    there = {value.event: value for value in other.values}
    return tuple(_mean_value(value, there[value.event], common, known) for value in one.values if value.event in there)


def alarms_together(one: Monitoring, other: Monitoring) -> tuple[Alarm, ...]:
    """Common changes of two series, judged by their mean over the events that both have.

    The rules and their rates are those of a single series. Empty without a baseline of both.

    Raises:
        ModelError: they are of different quantities.
    """
    if one.series.quantity != other.series.quantity:
        raise ModelError(f"{one.series.quantity} and {other.series.quantity} have no mean; give two of one quantity")
    if one.judged is None or other.judged is None or one.baseline is None:
        return ()
    judged = _mean(one.judged, other.judged, correlation(one, other))
    return alarms(one.baseline.model.quantity, one.baseline, judged)


def correlation(one: Monitoring, other: Monitoring) -> float:
    """Of the scatter of two series from event to event, by the events that both references have."""
    values = [{value.event: value.value for value in side.values if value.is_reference} for side in (one, other)]
    common = sorted(values[0].keys() & values[1].keys())
    first, last = (np.array([side[event] for event in common]) for side in values)
    scale = np.sqrt(float(first @ first) * float(last @ last))
    found = float(first @ last) / scale if scale > 0 else 0.0
    return max(0.0, (BELIEVED * COMMON + len(common) * found) / (BELIEVED + len(common)))


def _mean_value(one: EventValue, other: EventValue, common: float, known: Quantity) -> EventValue:
    """Of the deviations, which are logarithms where those are watched."""
    sides = (one, other)
    scale = [1 + side.value if known.is_logarithmic else 1.0 for side in sides]
    first, last = (side.std / factor for side, factor in zip(sides, scale, strict=True))
    factor = float(np.sqrt(scale[0] * scale[1]))
    return EventValue(
        event=one.event,
        time=min(one.time, other.time),
        value=factor - 1 if known.is_logarithmic else (one.value + other.value) / 2,
        std=factor * float(np.sqrt(first**2 + last**2 + 2 * common * first * last)) / 2,
        count=one.count + other.count,
        is_reference=one.is_reference or other.is_reference,
        is_beyond=one.is_beyond or other.is_beyond,
        is_excluded=one.is_excluded or other.is_excluded,
        causes=tuple(dict.fromkeys((*one.causes, *other.causes))),
    )


def _mean(one: Judged, other: Judged, common: float) -> Judged:
    """Of the events that both have."""
    here, there = _shared(one, other)
    first, last = one.covariance[np.ix_(here, here)], other.covariance[np.ix_(there, there)]
    # What is white in one series has this correlation with what is white in the other.
    across = common * np.linalg.cholesky(first) @ np.linalg.cholesky(last).T
    return Judged(
        dated=tuple(one.dated[n] for n in here),
        deviation=(one.deviation[here] + other.deviation[there]) / 2,
        covariance=(first + last + across + across.T) / 4,
        freedom=(one.freedom + other.freedom) / 2,
        before=_before(one.before, other.before, common),
    )


def _before(one: Before, other: Before, common: float) -> Before:
    """Of the events that both references have."""
    here, there = _shared(one, other)
    first, last = one.std[here], other.std[there]
    return Before(
        dated=tuple(one.dated[n] for n in here),
        deviation=(one.deviation[here] + other.deviation[there]) / 2,
        std=np.sqrt(first**2 + last**2 + 2 * common * first * last) / 2,
    )


def _shared(one: Judged | Before, other: Judged | Before) -> tuple[Indices, Indices]:
    place = {dated.event: n for n, dated in enumerate(other.dated)}
    here = [n for n, dated in enumerate(one.dated) if dated.event in place]
    there = [place[one.dated[n].event] for n in here]
    return np.array(here, dtype=np.intp), np.array(there, dtype=np.intp)
