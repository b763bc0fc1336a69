"""Has this series drifted? Its baseline, the value of every event, and what alarms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from math import ceil

import numpy as np

from core.arrays import Matrix, Vector
from core.drift.alarm import Alarm
from core.drift.alarms import alarms, alarms_within
from core.drift.baseline import FEWEST_EVENTS, Baseline, fit_baseline
from core.drift.causes import causes_of_events, with_causes
from core.drift.event_value import Deviation, EventNotes, EventValue, covariance, deviations, relative
from core.drift.judged import Before, Judged
from core.drift.quantities import Quantity, quantity
from core.drift.series import Series, SeriesArrays, SeriesEvent, series_arrays
from core.drift.softening import softening

GROWTH = 1.15
"""By which the reference grows from one attempt to the next until it determines the curve."""
NOTHING = EventNotes()


@dataclass(frozen=True, slots=True)
class Reference:
    """The period in which the building counts as healthy, both ends included."""

    start: datetime | None = None
    """None: from the first event on."""
    end: datetime | None = None
    """None: the first events until the curve is determined."""


@dataclass(frozen=True, slots=True, eq=False)
class Monitoring:
    """What is known of the drift of one series."""

    series: Series
    baseline: Baseline | None
    """None as long as nothing can be expected, and of the mean of two series."""
    wanted: int
    """Events that the reference still lacks."""
    values: tuple[EventValue, ...]
    """In order of time; empty as long as nothing can be expected."""
    alarms: tuple[Alarm, ...]
    """In the order in which they were raised."""
    judged: Judged | None = None
    """What the rules judged; None without a baseline."""


def monitor(series: Series, reference: Reference, notes: Mapping[int, EventNotes]) -> Monitoring:
    """Baseline, values and alarms of a series: the same whatever the order in which its observations came.

    Args:
        series: everything that was measured of one quantity.
        reference: when the building counts as healthy.
        notes: by event, where there is something to note.

    Raises:
        ModelError: the quantity is none that is watched.
    """
    known = quantity(series.quantity)
    every, dated = series_arrays(series)
    noted = [notes.get(one.event, NOTHING) for one in dated]
    healthy = _healthy(dated, noted, reference)
    if len(healthy) < FEWEST_EVENTS:
        return Monitoring(series, None, FEWEST_EVENTS - len(healthy), (), ())
    baseline = _baseline(known, every, dated, healthy, _sizes(len(healthy), reference))
    found = deviations(every, len(dated), baseline)
    shared = covariance(found, softening(every, dated, baseline), baseline)
    causes = causes_of_events(every, dated, found, baseline, noted)
    values = _values(found, np.sqrt(np.diag(shared)), dated, baseline, noted, causes)
    chosen = _comparable(values, baseline) if reference.end is not None or not baseline.events_needed else []
    judged = _judged(found, shared, dated, chosen, baseline)
    raised = (*alarms(known, baseline, judged), *alarms_within(known, baseline, every, dated, chosen))
    return Monitoring(series, baseline, baseline.events_needed, values, _told(raised, dated, causes, known), judged)


def _healthy(dated: Sequence[SeriesEvent], noted: Sequence[EventNotes], reference: Reference) -> list[int]:
    """Events of the reference period whose sensors are trusted."""
    return [
        n
        for n, (one, note) in enumerate(zip(dated, noted, strict=True))
        if (reference.start is None or one.time >= reference.start)
        and (reference.end is None or one.time <= reference.end)
        and not note.excluding
    ]


def _judged(
    found: Sequence[Deviation], shared: Matrix, dated: Sequence[SeriesEvent], chosen: Sequence[int], baseline: Baseline
) -> Judged:
    return Judged(
        dated=tuple(dated[n] for n in chosen),
        deviation=np.array([found[n].value for n in chosen]),
        covariance=shared[np.ix_(chosen, chosen)],
        freedom=baseline.scatter.freedom,
        before=_before(found, dated, baseline),
    )


def _before(found: Sequence[Deviation], dated: Sequence[SeriesEvent], baseline: Baseline) -> Before:
    reference = set(baseline.events)
    own = [n for n, one in enumerate(dated) if one.event in reference]
    return Before(
        dated=tuple(dated[n] for n in own),
        deviation=np.array([found[n].value for n in own]),
        std=np.sqrt(np.array([found[n].variance for n in own]) + baseline.scatter.events**2),
    )


def _told(
    raised: Sequence[Alarm], dated: Sequence[SeriesEvent], causes: Sequence[tuple[str, ...]], known: Quantity
) -> tuple[Alarm, ...]:
    """In the order in which they were raised, with what could explain them."""
    place = {one.event: n for n, one in enumerate(dated)}
    of_events = dict(zip(place, causes, strict=True))
    in_order = sorted(raised, key=lambda alarm: place[alarm.raised])
    return tuple(with_causes(one, known, of_events) for one in in_order)


def _sizes(count: int, reference: Reference) -> list[int]:
    """How many of the healthy events the reference is tried with, one after the other."""
    if reference.end is not None:
        return [count]
    sizes = [FEWEST_EVENTS]
    while sizes[-1] < count:
        sizes.append(min(count, ceil(sizes[-1] * GROWTH)))
    return sizes


def _baseline(
    known: Quantity, every: SeriesArrays, dated: Sequence[SeriesEvent], healthy: Sequence[int], sizes: Sequence[int]
) -> Baseline:
    """Of the first size that determines the curve, or of the last."""
    for size in sizes:
        chosen = np.array(healthy[:size])
        rows = every.subset(np.isin(every.event, chosen))
        own = replace(rows, event=np.searchsorted(chosen, rows.event))
        baseline = fit_baseline(known, own, tuple(dated[n].event for n in chosen))
        if not baseline.events_needed:
            break
    return baseline


def _values(
    found: Sequence[Deviation],
    std: Vector,
    dated: Sequence[SeriesEvent],
    baseline: Baseline,
    noted: Sequence[EventNotes],
    causes: Sequence[tuple[str, ...]],
) -> tuple[EventValue, ...]:
    reference, is_logarithmic = set(baseline.events), baseline.model.quantity.is_logarithmic
    return tuple(
        EventValue(
            event=when.event,
            time=when.time,
            value=relative(one.value, baseline),
            std=float(error * np.exp(one.value) if is_logarithmic else error),
            count=one.count,
            is_reference=when.event in reference,
            is_beyond=one.is_beyond,
            is_excluded=bool(note.excluding),
            causes=cause,
        )
        for when, one, error, note, cause in zip(dated, found, std, noted, causes, strict=True)
    )


def _comparable(values: Sequence[EventValue], baseline: Baseline) -> list[int]:
    """Those after the reference that can be compared with it."""
    last = max(n for n, one in enumerate(values) if one.is_reference)
    return [n for n, one in enumerate(values) if n > last and not one.is_beyond and not one.is_excluded]
