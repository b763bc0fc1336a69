"""Pooled monitoring of two directions by the mean of their series.

A damaged layer softens in every direction, and the scatter from event to event is only partly common to the directions,
so that their mean shows a common loss sooner than either of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np

from core.arrays import Indices
from core.drift.alarms import Alarm, Judgement, alarms, judged
from core.drift.causes import with_causes
from core.drift.change_statistics import DeviationSequence, ReferenceDeviations
from core.drift.deviations import EventValue, relative_change
from core.drift.monitor import EventValues, Judged, Monitoring
from core.drift.quantities import Quantity, quantity
from core.drift.series import Series
from core.errors import ModelError

PRIOR_CORRELATION = 0.5
"""Prior mean of the correlation between the scatter of two directions. A choice, halfway between none and all; the
histories of benchmarks/drift.py have 0.3."""
PRIOR_EVENTS = 10.0
"""Events that the prior counts for. A choice: half of the smallest reference."""


@dataclass(frozen=True, slots=True, eq=False)
class PooledValues(Sequence[EventValue]):
    """Mean values of the events that both series have, in order of time, made when they are read."""

    sides: tuple[Sequence[EventValue], Sequence[EventValue]]
    places: tuple[Indices, Indices]
    """(n,) index of each event in the values of each side."""
    events: Indices
    """(n,) identifiers."""
    correlation: float
    known: Quantity

    def __len__(self) -> int:
        return int(self.places[0].size)

    @overload
    def __getitem__(self, place: int) -> EventValue: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[EventValue, ...]: ...
    def __getitem__(self, place: int | slice) -> EventValue | tuple[EventValue, ...]:
        if isinstance(place, slice):
            return tuple(self[n] for n in range(*place.indices(len(self))))
        one, other = (side[int(where[place])] for side, where in zip(self.sides, self.places, strict=True))
        return _pooled_value(one, other, self.correlation, self.known)


def pooled(one: Monitoring, other: Monitoring, subject: str, before: Judged | None = None) -> Monitoring:
    """Monitoring of the mean of two series. It has no baseline: each series is compared with its own.

    Args:
        one: monitoring of one direction.
        other: monitoring of the other.
        subject: name of both together.
        before: what the rules left of the mean of the states that both were monitored with; it saves time and changes
            no result.

    Raises:
        ModelError: they are of different quantities.
    """
    known, values = quantity(one.series.quantity), pooled_values(one, other)
    is_same = (values.places[0] < one.unchanged) & (values.places[1] < other.unchanged)
    unchanged = len(values) if is_same.all() else int(is_same.argmin())
    tested = _tested(one, other)
    judgement, judged_events = Judgement((), None), None
    if tested is not None and one.baseline is not None:
        seen = None if before is None else before.seen[: before.same(tested, values.events[:unchanged])]
        judgement = judged(known, one.baseline, tested, seen)
        judged_events = Judged.after(tested, judgement)
    place = {event: n for n, event in enumerate(values.events.tolist())} if judgement.alarms else {}
    return Monitoring(
        series=Series(known.name, subject, ()),
        baseline=None,
        events_needed=max(one.events_needed, other.events_needed),
        values=values,
        alarms=tuple(with_causes(one, known, lambda event: values[place[event]].causes) for one in judgement.alarms),
        unchanged=unchanged,
        judged=judged_events,
    )


def pooled_values(one: Monitoring, other: Monitoring) -> PooledValues:
    """Mean value of each event that both series have, in order of time."""
    sides = (one.values, other.values)
    first, last = (side.summaries.event if isinstance(side, EventValues) else np.arange(0) for side in sides)
    here, there = _shared(first, last)
    return PooledValues(
        sides, (here, there), first[here], scatter_correlation(one, other), quantity(one.series.quantity)
    )


def pooled_alarms(one: Monitoring, other: Monitoring) -> tuple[Alarm, ...]:
    """Alarms on the mean of two series over the events that both have, without causes.

    The rules and their rates are those of a single series. Empty unless both have a baseline.

    Raises:
        ModelError: they are of different quantities.
    """
    tested = _tested(one, other)
    if tested is None or one.baseline is None:
        return ()
    return alarms(one.baseline.model.quantity, one.baseline, tested)


def scatter_correlation(one: Monitoring, other: Monitoring) -> float:
    """Correlation of the scatter of two series between events, from the events that both references have; 0 to 1."""
    values = [_reference_values(side) for side in (one, other)]
    common = sorted(values[0].keys() & values[1].keys())
    first, last = (np.array([side[event] for event in common]) for side in values)
    scale = np.sqrt(float(first @ first) * float(last @ last))
    correlation = float(first @ last) / scale if scale > 0 else 0.0
    return max(0.0, (PRIOR_EVENTS * PRIOR_CORRELATION + len(common) * correlation) / (PRIOR_EVENTS + len(common)))


def _reference_values(side: Monitoring) -> Mapping[int, float]:
    """Relative changes of the events of a reference, by event."""
    if side.tested is None or side.baseline is None:
        return {}
    known = side.tested.reference
    changes = (relative_change(one, side.baseline) for one in known.deviation.tolist())
    return dict(zip((one.event for one in known.events), changes, strict=True))


def _tested(one: Monitoring, other: Monitoring) -> DeviationSequence | None:
    """Mean deviations that the rules test; None unless both series have a baseline."""
    if one.series.quantity != other.series.quantity:
        raise ModelError(
            f"{one.series.quantity} and {other.series.quantity} cannot be pooled; give two series of one quantity"
        )
    if one.tested is None or other.tested is None:
        return None
    return _pooled_sequence(one.tested, other.tested, scatter_correlation(one, other))


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
    here, there = _shared(one.event, other.event)
    first, last = one.covariance[np.ix_(here, here)], other.covariance[np.ix_(there, there)]
    # The whitened deviations of the two series have this correlation.
    across = correlation * np.linalg.cholesky(first) @ np.linalg.cholesky(last).T
    return DeviationSequence(
        event=one.event[here],
        time=one.time[here],
        deviation=(one.deviation[here] + other.deviation[there]) / 2,
        own=np.zeros(here.size),
        common=np.zeros((here.size, 0)),
        freedom=(one.freedom + other.freedom) / 2,
        reference=_pooled_reference(one.reference, other.reference, correlation),
        correlated=(first + last + across + across.T) / 4,
    )


def _pooled_reference(one: ReferenceDeviations, other: ReferenceDeviations, correlation: float) -> ReferenceDeviations:
    """Mean over the events that both references have."""
    first_events, last_events = (np.array([each.event for each in side.events], np.intp) for side in (one, other))
    here, there = _shared(first_events, last_events)
    first, last = one.std[here], other.std[there]
    return ReferenceDeviations(
        events=tuple(one.events[n] for n in here),
        deviation=(one.deviation[here] + other.deviation[there]) / 2,
        std=np.sqrt(first**2 + last**2 + 2 * correlation * first * last) / 2,
    )


def _shared(one: Indices, other: Indices) -> tuple[Indices, Indices]:
    """Indices, in each of two lists of different identifiers, of those in both, in the order of the first list."""
    here = np.flatnonzero(np.isin(one, other))
    order = np.argsort(other)
    return here, order[np.searchsorted(other, one[here], sorter=order)]
