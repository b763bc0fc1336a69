"""The paper's building and its sensors in core's types, and those of the real building if its data is available."""

import tomllib
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from functools import cache

import numpy as np
import obspy
from ground_motions import RATE, akt013
from paper_records import FLOORS, SENSORS, START
from shared_data import BNCS

from core.arrays import Vector
from core.description import BuildingDescription, IsolationLayer, Level
from core.model.simulation import simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR
from core.record import Channel, Segment

GROUND, BASE, FOURTH, ROOF, LAYER = SENSORS


def paper() -> BuildingDescription:
    levels = [Level("ground", "ground"), Level("1F", "base", BUILDING.base_mass)]
    levels += [Level(name, "floor", float(mass)) for name, mass in zip(FLOORS, BUILDING.floor_mass, strict=True)]
    channels = tuple(Channel(name, level, quantity, "x") for name, (level, quantity) in SENSORS.items())
    return BuildingDescription("PAPER", "the paper's building", tuple(levels), IsolationLayer(0.2), channels)


def segments(samples: Mapping[str, Vector], rate: float = 100.0, start: datetime = START) -> list[Segment]:
    return [Segment(channel, start, rate, values) for channel, values in samples.items()]


@cache
def exact(motion: Callable[[], Vector], scale: float) -> tuple[Vector, ...]:
    ground = motion() * scale
    moved = simulate(BUILDING, ISOLATOR, ground, RATE)
    floors = moved.floor_acceleration
    return ground, moved.base_acceleration, floors[FOURTH_STOREY], floors[-1], moved.isolator_displacement


def records(
    seed: int, noise: float = 0.01, motion: Callable[[], Vector] = akt013, scale: float = 1.0
) -> dict[str, Vector]:
    rng = np.random.default_rng(seed)
    return {
        channel: samples + noise * samples.std() * rng.standard_normal(samples.size)
        for channel, samples in zip(SENSORS, exact(motion, scale), strict=True)
    }


def bncs() -> BuildingDescription:
    file = tomllib.loads((BNCS / "building.toml").read_text())
    levels = tuple(Level(at["name"], at.get("role", "floor"), at.get("mass")) for at in file["level"])
    channels = tuple(Channel(at["id"], at["level"], at["quantity"], at["direction"]) for at in file["channel"])
    return BuildingDescription(
        "BNCS", file["name"], levels, IsolationLayer(file["isolation"]["rubber_height"]), channels
    )


def bncs_segments(event: str) -> list[Segment]:
    return [
        Segment(
            trace.id, trace.stats.starttime.datetime.replace(tzinfo=UTC), trace.stats.sampling_rate, trace.data * 1.0
        )
        for trace in obspy.read(BNCS / f"{event}.mseed")
    ]
