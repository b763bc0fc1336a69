"""Monitoring of one series for drift: its baseline, the value of every event, and the alarms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from hashlib import sha256
from math import ceil
from types import MappingProxyType

import numpy as np

from core.arrays import Matrix, Vector
from core.drift.ageing import Ageing
from core.drift.alarms import Alarm, alarms
from core.drift.baseline import FEWEST_EVENTS, Baseline, fit_baseline
from core.drift.causes import causes_of_events, with_causes
from core.drift.change_statistics import DeviationSequence, ReferenceDeviations
from core.drift.deviations import (
    Deviation,
    EventNotes,
    EventValue,
    ageing_std,
    deviation_covariance,
    deviations,
    relative_change,
    softening_std,
)
from core.drift.quantities import Quantity, quantity
from core.drift.series import Series, SeriesArrays, SeriesEvent, series_arrays
from core.drift.within_event import alarms_within
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
class Monitoring:
    """Drift of one series, or of the mean of two."""

    series: Series
    baseline: Baseline | None
    """None while there are too few events, and for the mean of two series."""
    events_needed: int
    """Events that the reference lacks until the curve is determined."""
    values: tuple[EventValue, ...]
    """Values of all events in order of time; empty while there are too few."""
    alarms: tuple[Alarm, ...]
    """In the order in which they were raised."""
    tested: DeviationSequence | None = None
    """Deviations that the rules tested; None without a baseline."""

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
) -> Monitoring:
    """Monitor a series for drift. The order in which its measurements arrived does not matter.

    Args:
        series: all measurements of one quantity, as `core.drift_series` gives.
        reference: period in which the building counts as healthy.
        notes: notes by event, where there are any.
        ageing: hardening of the rubber, which is no change of stiffness; None where it is not known.
        earlier: baseline of an earlier monitoring by the same code: where its inputs are the same it is not fitted
            again, which changes no result.

    Raises:
        ModelError: the quantity is not monitored.
    """
    known = quantity(series.quantity)
    arrays, events = series_arrays(series)
    noted = [notes.get(one.event, NO_NOTES) for one in events]
    healthy = _healthy(events, noted, reference)
    if len(healthy) < FEWEST_EVENTS:
        return Monitoring(series, None, FEWEST_EVENTS - len(healthy), (), ())
    baseline = _baseline(known, arrays, events, healthy, reference, ageing, earlier)
    measured = deviations(arrays, len(events), baseline)
    common = np.hstack([softening_std(arrays, events, baseline), ageing_std(events, baseline)])
    covariance = deviation_covariance(measured, common, baseline)
    causes = causes_of_events(arrays, events, measured, baseline, noted)
    values = _values(measured, np.sqrt(np.diag(covariance)), events, baseline, noted, causes)
    chosen = _comparable(values) if reference.end is not None or not baseline.events_needed else []
    tested = _tested(measured, covariance, events, chosen, baseline)
    raised = (*alarms(known, baseline, tested), *alarms_within(known, baseline, arrays, events, chosen))
    ordered = _ordered(raised, events, causes, known)
    return Monitoring(series, baseline, baseline.events_needed, values, ordered, tested)


def _state(alarm: Alarm) -> str:
    return "" if alarm.is_sure else "; this alarm is pending"


def _shown(one: EventValue, known: Quantity) -> tuple[str, str, str]:
    """Cells of an event: its time, its deviation, and its part in the judgement."""
    scale, unit = (100.0, "%") if known.is_logarithmic else (1000.0, "mm")
    excluded = one.is_out_of_range or one.is_excluded
    use = "reference" if one.is_reference else "not tested" if excluded else "tested"
    return f"{one.time:%Y-%m-%d %H:%M} UTC", with_std(scale * one.value, scale * one.std, unit), use


def _healthy(events: Sequence[SeriesEvent], noted: Sequence[EventNotes], reference: Reference) -> list[int]:
    """Indices of the events of the reference period whose values are not excluded."""
    return [
        n
        for n, (one, note) in enumerate(zip(events, noted, strict=True))
        if (reference.start is None or one.time >= reference.start)
        and (reference.end is None or one.time <= reference.end)
        and not note.excluding
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


def _values(
    measured: Sequence[Deviation],
    std: Vector,
    events: Sequence[SeriesEvent],
    baseline: Baseline,
    noted: Sequence[EventNotes],
    causes: Sequence[tuple[str, ...]],
) -> tuple[EventValue, ...]:
    reference, is_logarithmic = set(baseline.events), baseline.model.quantity.is_logarithmic
    return tuple(
        EventValue(
            event=when.event,
            time=when.time,
            value=relative_change(one.value, baseline),
            std=float(error * np.exp(one.value) if is_logarithmic else error),
            count=one.count,
            is_reference=when.event in reference,
            is_out_of_range=one.is_out_of_range,
            is_excluded=bool(note.excluding),
            causes=cause,
        )
        for when, one, error, note, cause in zip(events, measured, std, noted, causes, strict=True)
    )


def _comparable(values: Sequence[EventValue]) -> list[int]:
    """Indices of the events after the reference that can be compared with it."""
    last = max(n for n, one in enumerate(values) if one.is_reference)
    return [n for n, one in enumerate(values) if n > last and not one.is_out_of_range and not one.is_excluded]


def _tested(
    measured: Sequence[Deviation],
    covariance: Matrix,
    events: Sequence[SeriesEvent],
    chosen: Sequence[int],
    baseline: Baseline,
) -> DeviationSequence:
    return DeviationSequence(
        events=tuple(events[n] for n in chosen),
        deviation=np.array([measured[n].value for n in chosen]),
        covariance=covariance[np.ix_(chosen, chosen)],
        freedom=baseline.scatter.freedom,
        reference=_reference(measured, events, baseline),
    )


def _reference(measured: Sequence[Deviation], events: Sequence[SeriesEvent], baseline: Baseline) -> ReferenceDeviations:
    reference = set(baseline.events)
    own = [n for n, one in enumerate(events) if one.event in reference]
    return ReferenceDeviations(
        events=tuple(events[n] for n in own),
        deviation=np.array([measured[n].value for n in own]),
        std=np.sqrt(np.array([measured[n].variance for n in own]) + baseline.scatter.events**2),
    )


def _ordered(
    raised: Sequence[Alarm], events: Sequence[SeriesEvent], causes: Sequence[tuple[str, ...]], known: Quantity
) -> tuple[Alarm, ...]:
    """Alarms in the order in which they were raised, with their possible causes."""
    place = {one.event: n for n, one in enumerate(events)}
    of_events = dict(zip(place, causes, strict=True))
    in_order = sorted(raised, key=lambda alarm: place[alarm.raised])
    return tuple(with_causes(one, known, of_events) for one in in_order)
