"""Pooled monitoring of two directions by the mean of their series.

A damaged layer softens in every direction, and the scatter from event to event is only partly common to the directions,
so that their mean shows a common loss sooner than either of them.
"""

import numpy as np

from core.arrays import Indices
from core.drift.alarms import Alarm, alarms
from core.drift.causes import with_causes
from core.drift.change_statistics import DeviationSequence, ReferenceDeviations
from core.drift.deviations import EventValue
from core.drift.monitor import Monitoring
from core.drift.quantities import Quantity, quantity
from core.drift.series import Series
from core.errors import ModelError

PRIOR_CORRELATION = 0.5
"""Prior mean of the correlation between the scatter of two directions. A choice, halfway between none and all; the
histories of benchmarks/drift.py have 0.3."""
PRIOR_EVENTS = 10.0
"""Events that the prior counts for. A choice: half of the smallest reference."""


def pooled(one: Monitoring, other: Monitoring, subject: str) -> Monitoring:
    """Monitoring of the mean of two series. It has no baseline: each series is compared with its own.

    Args:
        one: monitoring of one direction.
        other: monitoring of the other.
        subject: name of both together.

    Raises:
        ModelError: they are of different quantities.
    """
    known, values = quantity(one.series.quantity), pooled_values(one, other)
    causes = {value.event: value.causes for value in values}
    return Monitoring(
        series=Series(known.name, subject, ()),
        baseline=None,
        events_needed=max(one.events_needed, other.events_needed),
        values=values,
        alarms=tuple(with_causes(alarm, known, causes) for alarm in pooled_alarms(one, other)),
    )


def pooled_values(one: Monitoring, other: Monitoring) -> tuple[EventValue, ...]:
    """Mean value of each event that both series have, in order of time."""
    known, correlation = quantity(one.series.quantity), scatter_correlation(one, other)
    there = {value.event: value for value in other.values}
    return tuple(
        _pooled_value(value, there[value.event], correlation, known) for value in one.values if value.event in there
    )


def pooled_alarms(one: Monitoring, other: Monitoring) -> tuple[Alarm, ...]:
    """Alarms on the mean of two series over the events that both have, without causes.

    The rules and their rates are those of a single series. Empty unless both have a baseline.

    Raises:
        ModelError: they are of different quantities.
    """
    if one.series.quantity != other.series.quantity:
        raise ModelError(
            f"{one.series.quantity} and {other.series.quantity} cannot be pooled; give two series of one quantity"
        )
    if one.tested is None or other.tested is None or one.baseline is None:
        return ()
    tested = _pooled_sequence(one.tested, other.tested, scatter_correlation(one, other))
    return alarms(one.baseline.model.quantity, one.baseline, tested)


def scatter_correlation(one: Monitoring, other: Monitoring) -> float:
    """Correlation of the scatter of two series between events, from the events that both references have; 0 to 1."""
    values = [{value.event: value.value for value in side.values if value.is_reference} for side in (one, other)]
    common = sorted(values[0].keys() & values[1].keys())
    first, last = (np.array([side[event] for event in common]) for side in values)
    scale = np.sqrt(float(first @ first) * float(last @ last))
    correlation = float(first @ last) / scale if scale > 0 else 0.0
    return max(0.0, (PRIOR_EVENTS * PRIOR_CORRELATION + len(common) * correlation) / (PRIOR_EVENTS + len(common)))


def _pooled_value(one: EventValue, other: EventValue, correlation: float, known: Quantity) -> EventValue:
    """Mean of the deviations, which are logarithms where those are monitored."""
    sides = (one, other)
    scale = [1 + side.value if known.is_logarithmic else 1.0 for side in sides]
    first, last = (side.std / factor for side, factor in zip(sides, scale, strict=True))
    factor = float(np.sqrt(scale[0] * scale[1]))
    return EventValue(
        event=one.event,
        time=min(one.time, other.time),
        value=factor - 1 if known.is_logarithmic else (one.value + other.value) / 2,
        std=factor * float(np.sqrt(first**2 + last**2 + 2 * correlation * first * last)) / 2,
        count=one.count + other.count,
        is_reference=one.is_reference or other.is_reference,
        is_out_of_range=one.is_out_of_range or other.is_out_of_range,
        is_excluded=one.is_excluded or other.is_excluded,
        causes=tuple(dict.fromkeys((*one.causes, *other.causes))),
    )


def _pooled_sequence(one: DeviationSequence, other: DeviationSequence, correlation: float) -> DeviationSequence:
    """Mean over the events that both sequences have."""
    here, there = _shared(one, other)
    first, last = one.covariance[np.ix_(here, here)], other.covariance[np.ix_(there, there)]
    # The whitened deviations of the two series have this correlation.
    across = correlation * np.linalg.cholesky(first) @ np.linalg.cholesky(last).T
    return DeviationSequence(
        events=tuple(one.events[n] for n in here),
        deviation=(one.deviation[here] + other.deviation[there]) / 2,
        covariance=(first + last + across + across.T) / 4,
        freedom=(one.freedom + other.freedom) / 2,
        reference=_pooled_reference(one.reference, other.reference, correlation),
    )


def _pooled_reference(one: ReferenceDeviations, other: ReferenceDeviations, correlation: float) -> ReferenceDeviations:
    """Mean over the events that both references have."""
    here, there = _shared(one, other)
    first, last = one.std[here], other.std[there]
    return ReferenceDeviations(
        events=tuple(one.events[n] for n in here),
        deviation=(one.deviation[here] + other.deviation[there]) / 2,
        std=np.sqrt(first**2 + last**2 + 2 * correlation * first * last) / 2,
    )


def _shared(
    one: DeviationSequence | ReferenceDeviations, other: DeviationSequence | ReferenceDeviations
) -> tuple[Indices, Indices]:
    """Indices, in each of two sequences, of the events that both have."""
    place = {event.event: n for n, event in enumerate(other.events)}
    here = [n for n, event in enumerate(one.events) if event.event in place]
    there = [place[one.events[n].event] for n in here]
    return np.array(here, dtype=np.intp), np.array(there, dtype=np.intp)
