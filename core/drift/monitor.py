"""Monitoring of one series for drift: its baseline, the value of every event, and the alarms."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from hashlib import sha256
from math import ceil
from types import MappingProxyType
from typing import overload

import numpy as np

from core.arrays import Indices, Mask, Vector
from core.drift.ageing import Ageing
from core.drift.alarms import Alarm, Judgement, judged
from core.drift.baseline import FEWEST_EVENTS, Baseline, fit_baseline
from core.drift.causes import EventCauses, causes_of_events, with_causes
from core.drift.change_statistics import DeviationSequence, ReferenceDeviations
from core.drift.deviations import (
    EventNotes,
    EventSummaries,
    EventValue,
    common_errors,
    deviations,
    own_variance,
    relative_change,
)
from core.drift.quantities import Quantity, quantity
from core.drift.series import Series, SeriesArrays, SeriesEvent, series_arrays
from core.drift.within_event import alarms_within, contrasts
from core.rounding import with_std
from core.tables import Table, report

GROWTH = 1.15
"""Factor by which the reference grows from one attempt to the next until it determines the curve.
A choice: in each step the error of the curve falls by 7 %."""
NO_NOTES = EventNotes()
"""Notes of an event without any."""
MOST_SHOWN = 10
"""Latest events that a report shows."""


@dataclass(frozen=True, slots=True)
class Reference:
    """Period in which the building counts as healthy, both ends included."""

    start: datetime | None = None
    """Aware; None for the first event."""
    end: datetime | None = None
    """Aware; None for as many events as determine the curve."""


FIRST_EVENTS = Reference()
"""The first events, as many as determine the curve."""


@dataclass(frozen=True, slots=True, eq=False)
class EventValues(Sequence[EventValue]):
    """Values of all events in order of time, made when they are read: most are of events that changed nothing."""

    summaries: EventSummaries
    std: Vector
    """(n,) standard deviation of each deviation."""
    baseline: Baseline
    is_reference: Mask
    is_excluded: Mask
    causes: EventCauses

    @property
    def events(self) -> Indices:
        """(n,) identifiers."""
        return self.summaries.event

    def __len__(self) -> int:
        return int(self.summaries.event.size)

    @overload
    def __getitem__(self, place: int) -> EventValue: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[EventValue, ...]: ...
    def __getitem__(self, place: int | slice) -> EventValue | tuple[EventValue, ...]:
        if isinstance(place, slice):
            return tuple(self[n] for n in range(*place.indices(len(self))))
        place = range(len(self))[place]
        when, value, std = self.summaries.at(place), float(self.summaries.value[place]), self.std[place]
        return EventValue(
            event=when.event,
            time=when.time,
            value=relative_change(value, self.baseline),
            std=float(std * np.exp(value) if self.baseline.model.quantity.is_logarithmic else std),
            count=int(self.summaries.count[place]),
            is_reference=bool(self.is_reference[place]),
            is_out_of_range=bool(self.summaries.is_out_of_range[place]),
            is_excluded=bool(self.is_excluded[place]),
            causes=self.causes.of(place),
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and tuple(self) == tuple(other)

    __hash__ = None  # type: ignore[assignment]  # as of a list


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """Events that the rules tested without a sure change."""

    tested: Indices
    """(k,) identifiers, in order of time."""
    seen: Vector
    """(k,) their deviations as the rules saw them."""

    @classmethod
    def after(cls, tested: DeviationSequence, judgement: Judgement) -> "Judged":
        """After the rules were applied to these deviations; without events if a change is sure."""
        seen = np.zeros(0) if judgement.seen is None else judgement.seen
        return cls(tested.event[: seen.size], seen)

    def same(self, tested: DeviationSequence, unchanged: Indices) -> int:
        """Number of the first of them that are tested again in the same place and are unchanged."""
        count = min(self.tested.size, tested.event.size)
        same = (self.tested[:count] == tested.event[:count]) & np.isin(tested.event[:count], unchanged)
        return count if same.all() else int(same.argmin())


@dataclass(frozen=True, slots=True, eq=False)
class SeriesState:
    """State that one monitoring leaves to the next, which then needs the measurements of changed events only."""

    inputs: str
    """`Baseline.inputs` of the baseline that the summaries are of."""
    summaries: EventSummaries
    """All events."""
    judged: Judged


@dataclass(frozen=True, slots=True, eq=False)
class Monitoring:
    """Drift of one series, or of the mean of two."""

    series: Series
    baseline: Baseline | None
    """None while there are too few events, and for the mean of two series."""
    events_needed: int
    """Events that the reference lacks until the curve is determined."""
    values: Sequence[EventValue]
    """Values of all events in order of time; empty while there are too few."""
    alarms: tuple[Alarm, ...]
    """In the order in which they were raised."""
    tested: DeviationSequence | None = None
    """Deviations that the rules tested; None without a baseline."""
    unchanged: int = 0
    """Number of the first values that an earlier monitoring gave too."""
    judged: Judged | None = None
    """None without a baseline."""

    @property
    def state(self) -> SeriesState | None:
        """State for the next monitoring; None if that needs all measurements."""
        if self.baseline is None or self.events_needed or not isinstance(self.values, EventValues):
            return None
        return None if self.judged is None else SeriesState(self.baseline.inputs, self.values.summaries, self.judged)

    def __str__(self) -> str:
        known = quantity(self.series.quantity)
        title = f"Drift of the {known.title}, {self.series.subject}"
        if self.events_needed:
            sentences = [f"The baseline needs {self.events_needed} more events before a change can raise an alarm."]
        elif self.alarms:
            sentences = [
                f"{one.message[0].upper()}{one.message[1:]}{'' if one.is_sure else ' (pending)'}."
                for one in self.alarms
            ]
        else:
            sentences = ["No change was found."]
        rows = tuple(_shown(one, known) for one in self.values[-MOST_SHOWN:])
        headings = ("event of", "change and its standard deviation", "use")
        table = Table(f"The latest {len(rows)} of {len(self.values)} events", headings, rows, texts=("use",))
        causes = dict.fromkeys(cause for one in self.alarms for cause in one.causes)
        others = [f"Other possible causes: {'; '.join(causes)}."] if causes else []
        return report(title, sentences, table if rows else None, others)


def monitor(
    series: Series,
    reference: Reference = FIRST_EVENTS,
    notes: Mapping[int, EventNotes] = MappingProxyType({}),
    ageing: Ageing | None = None,
    earlier: Baseline | None = None,
    before: SeriesState | None = None,
    omitted: Collection[int] = (),
) -> Monitoring:
    """Monitor a series for drift. The order in which its measurements arrived does not matter.

    `earlier`, `before` and `omitted` save time and change no result.

    Args:
        series: all measurements of one quantity, as `core.drift_series` gives, but for those of `omitted` events.
        reference: period in which the building counts as healthy.
        notes: notes by event, where there are any.
        ageing: hardening of the rubber, which is no change of stiffness; None where it is not known.
        earlier: baseline of an earlier monitoring by the same code: where its inputs are the same it is not fitted
            again.
        before: state that an earlier monitoring left.
        omitted: identifiers of events whose measurements are as they were for `before` and therefore not in the
            series. The events of the series, and those that were removed, are after the reference: `is_after`.

    Raises:
        ModelError: the quantity is not monitored.
    """
    known = quantity(series.quantity)
    arrays, events = series_arrays(series)
    if before is not None and omitted and earlier is not None:
        baseline = earlier
        summaries = before.summaries.subset(np.isin(before.summaries.event, list(omitted)))
        summaries = summaries.joined(_summarised(arrays, events, baseline)) if events else summaries
    else:
        healthy = _healthy(events, notes, reference)
        if len(healthy) < FEWEST_EVENTS:
            return Monitoring(series, None, FEWEST_EVENTS - len(healthy), (), ())
        baseline = _baseline(known, arrays, events, healthy, reference, ageing, earlier)
        summaries = _summarised(arrays, events, baseline)
    return _monitoring(series, baseline, summaries, reference, notes, before)


def is_after(moment: datetime, baseline: Baseline, last: datetime, reference: Reference) -> bool:
    """True if an event of that time leaves the baseline as it is.

    Args:
        moment: start of the event, aware.
        baseline: baseline of the series.
        last: time of the last event of the reference.
        reference: period in which the building counts as healthy.
    """
    if reference.end is not None:
        return moment > max(last, reference.end)
    size = len(baseline.events)
    # A reference of another size was all that there was, and grows with the next event.
    return not baseline.events_needed and size in _sizes(2 * size, reference) and moment > last


def _monitoring(
    series: Series,
    baseline: Baseline,
    summaries: EventSummaries,
    reference: Reference,
    notes: Mapping[int, EventNotes],
    before: SeriesState | None,
) -> Monitoring:
    known, own, common = baseline.model.quantity, own_variance(summaries, baseline), common_errors(summaries, baseline)
    values = EventValues(
        summaries=summaries,
        std=np.sqrt(own + (common**2).sum(axis=1)),
        baseline=baseline,
        is_reference=np.isin(summaries.event, baseline.events),
        is_excluded=np.isin(summaries.event, [event for event, note in notes.items() if note.excluding]),
        causes=causes_of_events(summaries, baseline, notes),
    )
    chosen = _comparable(values) if reference.end is not None or not baseline.events_needed else np.arange(0)
    tested = DeviationSequence(
        event=summaries.event[chosen],
        time=summaries.time[chosen],
        deviation=summaries.value[chosen],
        own=own[chosen],
        common=common[chosen],
        freedom=baseline.scatter.freedom,
        reference=_reference(values, own),
    )
    valid = None if before is None or before.inputs != baseline.inputs else before
    unchanged = 0 if valid is None else summaries.same_until(valid.summaries)
    seen = None if valid is None else valid.judged.seen[: valid.judged.same(tested, summaries.event[:unchanged])]
    judgement = judged(known, baseline, tested, seen)
    raised = (*judgement.alarms, *alarms_within(known, baseline, summaries, chosen))
    ordered = _ordered(raised, summaries, values.causes, known)
    left = Judged.after(tested, judgement)
    return Monitoring(series, baseline, baseline.events_needed, values, ordered, tested, unchanged, left)


def _summarised(arrays: SeriesArrays, events: Sequence[SeriesEvent], baseline: Baseline) -> EventSummaries:
    """Summaries of the events, each with one measurement at least."""
    count = len(events)
    edges = np.searchsorted(arrays.event, np.arange(count))
    return EventSummaries(
        np.array([one.event for one in events], dtype=np.intp),
        np.array([one.time.timestamp() for one in events]),
        *deviations(arrays, count, baseline),
        ~np.isnan(arrays.temperature[edges]),
        np.maximum.reduceat(arrays.amplitude, edges),
        *contrasts(arrays, count, baseline),
    )


def _shown(one: EventValue, known: Quantity) -> tuple[str, str, str]:
    """Cells of an event: its time, its deviation, and its part in the judgement."""
    scale, unit = (100.0, "%") if known.is_logarithmic else (1000.0, "mm")
    excluded = one.is_out_of_range or one.is_excluded
    use = "reference" if one.is_reference else "not tested" if excluded else "tested"
    return f"{one.time:%Y-%m-%d %H:%M} UTC", with_std(scale * one.value, scale * one.std, unit), use


def _healthy(events: Sequence[SeriesEvent], notes: Mapping[int, EventNotes], reference: Reference) -> list[int]:
    """Indices of the events of the reference period whose values are not excluded."""
    return [
        n
        for n, one in enumerate(events)
        if (reference.start is None or one.time >= reference.start)
        and (reference.end is None or one.time <= reference.end)
        and not notes.get(one.event, NO_NOTES).excluding
    ]


def _sizes(count: int, reference: Reference) -> list[int]:
    """Numbers of healthy events with which the reference is tried, one after the other."""
    if reference.end is not None:
        return [count]
    sizes = [FEWEST_EVENTS]
    while sizes[-1] < count:
        sizes.append(min(count, ceil(sizes[-1] * GROWTH)))
    return sizes


def _baseline(
    known: Quantity,
    arrays: SeriesArrays,
    events: Sequence[SeriesEvent],
    healthy: Sequence[int],
    reference: Reference,
    ageing: Ageing | None,
    earlier: Baseline | None,
) -> Baseline:
    """Baseline of the first size that determines the curve, or of the last."""

    def rows_of(size: int) -> SeriesArrays:
        chosen = np.array(healthy[:size])
        rows = arrays.subset(np.isin(arrays.event, chosen))
        return replace(rows, event=np.searchsorted(chosen, rows.event))

    def inputs(size: int) -> str:
        return _digest(rows_of(size), (known.name, *(events[n] for n in healthy[:size])), (reference, ageing))

    tried = 0 if earlier is None else len(earlier.events)
    if earlier is None or tried > len(healthy) or inputs(tried) != earlier.inputs:
        earlier, tried = None, 0
    for size in _sizes(len(healthy), reference):
        if earlier is not None and size == tried:
            baseline = earlier
        elif size > tried:  # no smaller reference determined the curve
            baseline = fit_baseline(known, rows_of(size), tuple(events[n].event for n in healthy[:size]), ageing)
            baseline = replace(baseline, inputs=inputs(size))
        else:
            continue
        if not baseline.events_needed:
            break
    return baseline


def _digest(rows: SeriesArrays, *others: object) -> str:
    """SHA-256 of measurements and of what else decides a baseline."""
    columns = (rows.event, rows.time, rows.value, rows.variance, rows.amplitude, rows.temperature)
    return sha256(
        b"".join([repr(others).encode(), *(np.ascontiguousarray(one).tobytes() for one in columns)])
    ).hexdigest()


def _comparable(values: EventValues) -> Indices:
    """Indices of the events after the reference that can be compared with it."""
    is_comparable = ~values.summaries.is_out_of_range & ~values.is_excluded
    is_comparable[: 1 + np.flatnonzero(values.is_reference).max()] = False
    return np.flatnonzero(is_comparable)


def _reference(values: EventValues, own: Vector) -> ReferenceDeviations:
    places = np.flatnonzero(values.is_reference)
    return ReferenceDeviations(
        events=tuple(values.summaries.at(n) for n in places.tolist()),
        deviation=values.summaries.value[places],
        std=np.sqrt(own[places]),
    )


def _ordered(
    raised: Sequence[Alarm], summaries: EventSummaries, causes: EventCauses, known: Quantity
) -> tuple[Alarm, ...]:
    """Alarms in the order in which they were raised, with their possible causes."""
    if not raised:
        return ()
    place = {event: n for n, event in enumerate(summaries.event.tolist())}
    in_order = sorted(raised, key=lambda alarm: place[alarm.raised])
    return tuple(with_causes(one, known, lambda event: causes.of(place[event])) for one in in_order)
