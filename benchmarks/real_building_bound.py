"""`python -m benchmarks.real_building_bound` prints how well fixed weights of a real building's channels could do.

A few measured levels are weighed by complex factors, one for each channel and each of a few frequency bands, which are
fitted to the exact force of the very test. An estimator that is linear and does not change within a record, and whose
weights change with frequency no more finely, cannot do better; and it has to find its weights without that force.
"""

import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the truths are the tests'

from real_building import TESTS, best_instantaneous, inertia, superstructure

from benchmarks.table import Table
from core.comparison.misfit import fitting_rate
from core.estimators.frame.estimator import estimate

GOALS = {("4", "roof"): (99.6, 99.6, 99.6), ("roof",): (99.0, 99.0, 99.0)}
"""%, fit in each of TESTS that was asked for, by the floors that are measured."""
EDGES = (0.0, 0.6, 1.2, 1.8, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 9.0, 11.0, 13.0, 16.0, 20.0, 25.0, 50.0)
"""Hz, of the bands: sixteen."""


def best_by_band(test: str, floors: tuple[str, ...]) -> float:
    """%, fit of the best weights of the measured channels in each band, learnt from the very test's exact force."""
    seen, force = superstructure(test, floors), inertia(test)
    channels = np.fft.rfft(np.vstack([seen.base_acceleration, seen.floor_acceleration]), axis=1)
    exact, frequency = np.fft.rfft(force), np.fft.rfftfreq(force.size, 1 / seen.rate)
    weighed = np.zeros_like(exact)
    for low, high in pairwise(EDGES):
        band = (frequency >= low) & (frequency < high)
        weights = np.linalg.lstsq(channels[:, band].T, exact[band], rcond=None)[0]
        weighed[band] = weights @ channels[:, band]
    return fitting_rate(force, np.fft.irfft(weighed, force.size))


def _rows() -> Iterator[tuple[str, ...]]:
    for floors, goals in GOALS.items():
        reached = [fitting_rate(inertia(test), estimate(superstructure(test, floors)).force) for test in TESTS]
        fixed = [best_instantaneous(test, floors) for test in TESTS]
        by_band = [best_by_band(test, floors) for test in TESTS]
        shown = (" / ".join(f"{one:.2f}" for one in each) for each in (goals, reached, fixed, by_band))
        yield (f"base, {', '.join(floors)}", *shown)


def table() -> Table:
    """Goals, what the estimator reaches, and the bounds."""
    about = (
        f"Fit in % for {' / '.join(TESTS)}. The last two columns are fitted to the exact force of the same test: one "
        f"weight for each channel, and {len(EDGES) - 1} complex weights, one for each band of frequencies."
    )
    headings = ("floors", "goal", "smoother", "best fixed weights", "best weights by band")
    return Table("The force of the real building, and a bound", about, headings, tuple(_rows()))


if __name__ == "__main__":
    print(table().markdown())
