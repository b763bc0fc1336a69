"""The paper's building under two recorded motions at once, one along x and one along y, with two-axis sensors."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
from building_models import paper, records
from ground_motions import RATE, akt013, kobe
from paper_records import START

from core.arrays import Vector
from core.description import BuildingDescription
from core.record import Channel, Record

Motion = Callable[[], Vector]


def biaxial_records(
    along: Motion = akt013, across: Motion = kobe, noise: float = 0.01, scale: float = 1.0
) -> tuple[BuildingDescription, dict[str, Vector]]:
    """Channels end in X and in Y."""
    description, samples = _biaxial(along, across, noise, scale)
    return description, dict(samples)


@cache
def _biaxial(
    along: Motion, across: Motion, noise: float, scale: float
) -> tuple[BuildingDescription, Mapping[str, Vector]]:
    described = paper()
    channels = [
        replace(channel, id=f"{channel.id[:-1]}{name.upper()}", direction=name)
        for channel in described.channels
        for name in ("x", "y")
    ]
    samples = {
        f"{channel[:-1]}{name}": values
        for seed, (name, motion) in enumerate({"X": along, "Y": across}.items(), start=9)
        for channel, values in records(seed, noise, motion, scale).items()
    }
    return replace(described, channels=tuple(channels)), samples


def turned(samples: dict[str, Vector], sensor: str, degrees: float) -> dict[str, Vector]:
    """The samples with the axes of a sensor (its id without X or Y) turned from x towards y."""
    x, y = samples[f"{sensor}X"], samples[f"{sensor}Y"]
    c, s = np.cos(np.deg2rad(degrees)), np.sin(np.deg2rad(degrees))
    return samples | {f"{sensor}X": c * x + s * y, f"{sensor}Y": -s * x + c * y}


def record_of(channels: tuple[Channel, ...], samples: dict[str, Vector]) -> Record:
    """A record as preparation hands it over."""
    known = tuple(channel for channel in channels if channel.id in samples)
    return Record(START, RATE, known, np.array([samples[channel.id] for channel in known]))
