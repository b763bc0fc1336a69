"""What may the largest earthquakes so far have taken from the layer for a while?

Rubber that is stretched farther than before softens (scragging, the Mullins effect) and comes back with time. Nobody
knows how much before it has come back, so that it is a common error of the events after, with a standard deviation that
grows with how far the earthquake exceeded all before and halves with every month.
"""

from collections.abc import Sequence
from datetime import timedelta

import numpy as np

from core.arrays import Matrix, Vector
from core.drift.baseline import Baseline
from core.drift.series import SeriesArrays, SeriesEvent

HALVING = timedelta(days=30)
"""In which half of what was lost comes back."""
WITHIN = 0.5
"""Of the softening that an earthquake's own cycles show: those after its largest."""


def softening(points: SeriesArrays, dated: Sequence[SeriesEvent], baseline: Baseline) -> Matrix:
    """(n, earthquakes) standard deviation, at each event, of what each earthquake beyond all before took."""
    if baseline.model.quantity.softening == 0.0:
        return np.zeros((len(dated), 0))
    excess = excesses(points, len(dated), baseline)
    day = np.array([one.time.timestamp() for one in dated]) / HALVING.total_seconds()
    since = day[:, None] - day[None, excess > 0]
    after = np.where(since > 0, 0.5 ** np.maximum(since, 0.0), np.where(since == 0, WITHIN, 0.0))
    return np.asarray(baseline.model.quantity.softening * after * excess[excess > 0])


def excesses(points: SeriesArrays, count: int, baseline: Baseline) -> Vector:
    """(count,) natural logarithm by which an event's largest amplitude exceeds the reference's and all before."""
    peaks = np.maximum.reduceat(points.amplitude, np.searchsorted(points.event, np.arange(count)))
    before = np.maximum.accumulate(np.concatenate([[baseline.model.high], peaks]))[:-1]
    return np.asarray(np.maximum(0.0, peaks - before))
