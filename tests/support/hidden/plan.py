"""Plan of a trial's earthquakes: dates, strengths and temperatures."""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from hidden.building import GRAVITY
from hidden.ground import MOTIONS, motion
from hidden.integration import Shaking
from hidden.law import Need

START = datetime(2019, 3, 5, 6, 7, 8, tzinfo=UTC)
"""Time of the first earthquake."""
PEAKS = (0.004, 0.020, 0.080, 0.030, 0.050)
"""m, that the isolation layer about reaches along x in the earthquakes, by date."""
FITTED = 4
"""Number of earthquakes to fit; the last one is held out for prediction."""


@dataclass(frozen=True, slots=True)
class Plan:
    """One earthquake as planned."""

    start: datetime
    peak: float
    """m, for the isolation layer along x."""
    motion: int
    """Index in hidden.ground.MOTIONS, along x; the record's other component is along y."""
    vertical: int
    """Index of the motion that replaces the vertical one, which the package lacks."""
    temperature: float
    """°C."""


def plans(rng: np.random.Generator) -> tuple[Plan, ...]:
    """The earthquakes of one trial, about 40 days apart."""
    records = rng.choice(len(MOTIONS) // 2, 2 * len(PEAKS), replace=False)
    return tuple(
        Plan(
            START + timedelta(days=40 * number, seconds=float(round(number and rng.uniform(0, 20 * 86400)))),
            peak,
            motion=2 * int(along) + int(rng.integers(2)),
            vertical=2 * int(upwards),
            temperature=float(rng.uniform(3, 33)),
        )
        for number, (peak, along, upwards) in enumerate(
            zip(PEAKS, records[: len(PEAKS)], records[len(PEAKS) :], strict=True)
        )
    )


def shaking(plan: Plan, scale: float, rate: float, happens: frozenset[Need]) -> Shaking:
    """Ground motion and conditions; `scale` is the peak ground acceleration along x in m/s²."""
    axes = [scale * motion(plan.motion, rate)]
    if "cross" in happens:
        axes.append(0.8 * scale * motion(plan.motion ^ 1, rate))
    upwards = 0.7 * scale / GRAVITY * motion(plan.vertical, rate) if "vertical" in happens else np.zeros(axes[0].size)
    time = (plan.start - START).total_seconds()
    return Shaking(1 / rate, np.array(axes), upwards, plan.temperature if "temperature" in happens else 20.0, time)
