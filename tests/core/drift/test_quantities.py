"""Every quantity: no alarm while it is healthy, an alarm when it changes for the worse."""

from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from core.drift.monitor import Reference, monitor
from core.drift.quantities import QUANTITIES, quantity
from core.drift.series import Measurement, Series

START = datetime(2010, 1, 1, tzinfo=UTC)
EVENTS, ONSET = 60, 40


def one_per_event(name: str, change: float, seed: int) -> Series:
    """One measurement per event, with the quantity's typical scatter and a change, in scatters, from the onset on."""
    known, rng = quantity(name), np.random.default_rng(seed)
    deviation = known.scatter * (rng.standard_normal(EVENTS) + change * (np.arange(EVENTS) >= ONSET))
    values = 2.0 * np.exp(deviation) if known.is_logarithmic else deviation
    std = 0.2 * known.scatter * (2.0 if known.is_logarithmic else 1.0)
    amplitude = 0.01 * np.exp(0.8 * rng.standard_normal(EVENTS)) if known.follows_amplitude else [None] * EVENTS
    times = [START + timedelta(days=10 * n) for n in range(EVENTS)]
    return Series(
        name,
        "any",
        tuple(
            Measurement(
                n, times[n], float(values[n]), std, amplitude[n] if amplitude[n] is None else float(amplitude[n])
            )
            for n in range(EVENTS)
        ),
    )


@pytest.mark.parametrize("name", QUANTITIES)
def test_a_healthy_series_raises_no_alarm(name: str) -> None:
    assert not [a for a in monitor(one_per_event(name, 0.0, 2), Reference(), {}).alarms if a.is_sure]


@pytest.mark.parametrize("name", QUANTITIES)
def test_a_change_for_the_worse_raises_an_alarm(name: str) -> None:
    known = quantity(name)
    for sense in {"less": (-1,), "more": (1,), "either": (-1, 1)}[known.harm]:
        (alarm,) = [a for a in monitor(one_per_event(name, 8.0 * sense, 2), Reference(), {}).alarms if a.is_sure]
        assert (alarm.rule, alarm.onset) == ("sudden", ONSET)
        assert alarm.raised <= ONSET + 3
        size = np.expm1(8 * sense * known.scatter) if known.is_logarithmic else 8 * sense * known.scatter
        assert alarm.low < size < alarm.high
        assert ("mm" in alarm.message) == (not known.is_logarithmic)
