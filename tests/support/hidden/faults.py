"""Sensor faults, and their effect on a channel."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from core.arrays import Matrix, Vector
from core.record import Channel
from hidden.sensors import RATE, late, shifted


@dataclass(frozen=True, slots=True)
class Fault:
    """One channel's fault, the same in all earthquakes."""

    kind: str
    channel: str
    """Id."""
    value: float
    """Value of the kind: see KINDS."""
    other: str = ""
    """Id of the channel that it is exchanged or mixed with, if its kind does that."""


@dataclass(frozen=True, slots=True)
class Kind:
    """Effect of a kind of fault."""

    unit: str
    """Unit of its value."""
    drawn: Callable[[np.random.Generator], float]
    applied: Callable[[Matrix, float, np.random.Generator], Matrix]
    """((1 or 2, n) samples, value, rng) → what is recorded in their place."""


def faulty(samples: Matrix, channels: tuple[Channel, ...], fault: Fault, rng: np.random.Generator) -> Matrix:
    """(channels, n) the samples as they are recorded with the fault."""
    ids = [channel.id for channel in channels]
    rows = [ids.index(name) for name in (fault.channel, fault.other) if name]
    found = samples.copy()
    found[rows] = KINDS[fault.kind].applied(samples[rows], fault.value, rng)
    return found


def _sided(low: float, high: float) -> Callable[[np.random.Generator], float]:
    return lambda rng: float(rng.choice([-1.0, 1.0]) * rng.uniform(low, high))


def _between(low: float, high: float) -> Callable[[np.random.Generator], float]:
    return lambda rng: float(rng.uniform(low, high))


def _late(samples: Vector, value: float, rng: np.random.Generator) -> Vector:
    return late(samples, value)


def _fast(samples: Vector, value: float, rng: np.random.Generator) -> Vector:
    return shifted(samples, np.clip(np.arange(samples.size) * (1 - value), 0, samples.size - 1))


def _drifting(samples: Vector, value: float, rng: np.random.Generator) -> Vector:
    """A straight line and half a wave, of that many root mean squares in all."""
    share, time = rng.uniform(0.3, 0.7), np.linspace(0, 1, samples.size)
    shape = share * time + (1 - share) * np.sin(np.pi * time)
    return np.asarray(samples + value * float(np.sqrt(np.mean(samples**2))) * shape)


def _spiked(samples: Vector, value: float, rng: np.random.Generator) -> Vector:
    found, places = samples.copy(), rng.choice(samples.size, int(rng.integers(4, 12)), replace=False)
    found[places] += rng.choice([-1.0, 1.0], places.size) * value * np.abs(samples).max()
    return found


def _dropped(samples: Vector, value: float, rng: np.random.Generator) -> Vector:
    """Two pieces of that many seconds are not there."""
    found, count = samples.copy(), max(round(value * RATE), 1)
    for place in rng.integers(samples.size // 10, samples.size - samples.size // 10, 2):
        found[place : place + count] = np.nan
    return found


def _clipped(samples: Vector, value: float, rng: np.random.Generator) -> Vector:
    largest = value * np.abs(samples).max()
    return np.clip(samples, -largest, largest)


def _rotated(samples: Matrix, value: float, rng: np.random.Generator) -> Matrix:
    c, s = np.cos(np.deg2rad(value)), np.sin(np.deg2rad(value))
    return np.array([[c, s], [-s, c]]) @ samples


def _alone(applied: Callable[[Vector, float, np.random.Generator], Vector]) -> Callable[..., Matrix]:
    return lambda samples, value, rng: applied(samples[0], value, rng)[None]


KINDS: Mapping[str, Kind] = MappingProxyType(
    {
        "gain": Kind("1, by which it is off", _sided(0.05, 0.25), lambda x, value, rng: x * (1 + value)),
        "delay": Kind("s", _between(0.005, 0.04), _alone(_late)),
        "polarity": Kind("1", lambda rng: -1.0, lambda x, value, rng: -x),
        "swap": Kind("1", lambda rng: 1.0, lambda x, value, rng: x[::-1]),
        "rotation": Kind("degrees, from x towards y", _sided(8.0, 40.0), _rotated),
        "drift": Kind("root mean squares", _sided(0.3, 1.5), _alone(_drifting)),
        "clipping": Kind("of the largest value", _between(0.3, 0.7), _alone(_clipped)),
        "spikes": Kind("of the largest value", _between(1.0, 4.0), _alone(_spiked)),
        "dropped": Kind("s", _between(0.05, 1.0), _alone(_dropped)),
        "clock": Kind("s per s, that it is slow", _sided(2e-4, 1e-3), _alone(_fast)),
    }
)
