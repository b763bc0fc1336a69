"""`python -m benchmarks.drift_chain` measures how much the results of the whole chain scatter between healthy events.

The paper's building, whose layer does not change, under recorded ground motions of many sizes, with noise of 1 % in
every sensor: the scatter is the error of the analysis, to which a real layer adds its own.
"""

import sys
from datetime import datetime, timedelta
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests" / "support"))  # the building is the tests'

import numpy as np
from building_models import paper, records, segments
from ground_motions import RATE, akt013, chi_chi, delta, hector, kobe
from paper_records import START

from core.analysis import AnalysisSettings, analyse
from core.drift.monitor import Reference, monitor
from core.drift.series import Measurement, Series

MOTIONS = (akt013, kobe, chi_chi, delta, hector)
EVENTS = 24
SMALLEST, LARGEST = 0.035, 1.05
"""m/s², peak acceleration of the ground."""
APART = timedelta(days=20)


def measurements(event: int, rng: np.random.Generator) -> list[Measurement]:
    """The cycles of one event."""
    motion = MOTIONS[event % len(MOTIONS)]
    peak = float(np.exp(rng.uniform(np.log(SMALLEST), np.log(LARGEST))))
    start: datetime = START + event * APART
    read = records(event, motion=motion, scale=peak / float(np.abs(motion()).max()))
    found = analyse(segments(read, RATE, start), paper(), AnalysisSettings())
    return [
        Measurement(event, start + timedelta(seconds=one.start), one.k_eq, one.k_eq_std, one.amplitude)
        for one in found.directions["x"].equivalent
    ]


def main() -> None:
    """Scatter of the events and of their cycles, onto the screen."""
    rng = np.random.default_rng(1)
    cycles = [one for event in range(EVENTS) for one in measurements(event, rng)]
    found = monitor(Series("stiffness", "x", tuple(cycles)), Reference(), {})
    scatter = np.std([value.value for value in found.values])
    print(f"{EVENTS} events, {len(cycles) / EVENTS:.0f} cycles an event; event values scatter by {100 * scatter:.2f} %")


if __name__ == "__main__":
    main()
