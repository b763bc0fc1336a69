"""The paper's building as a monitoring system delivers it: a building file, and miniSEED in counts."""

from datetime import UTC, datetime, timedelta
from io import BytesIO

import numpy as np
import obspy
from ground_motions import RATE, akt013

from core.arrays import Vector
from core.model.simulation import Response, simulate
from core.paper import BUILDING, FOURTH_STOREY, ISOLATOR

START = datetime(2024, 3, 5, 6, 7, 8, tzinfo=UTC)
GAIN = 1e-6
"""m/s² and m per count."""
FLOORS = ("2F", "3F", "4F", "5F", "6F", "7F", "RF")
SENSORS = {
    "XX.PAPER.00.HNX": ("ground", "acceleration"),
    "XX.PAPER.01.HNX": ("1F", "acceleration"),
    "XX.PAPER.04.HNX": (FLOORS[FOURTH_STOREY], "acceleration"),
    "XX.PAPER.08.HNX": (FLOORS[-1], "acceleration"),
    "XX.PAPER.01.HYX": ("1F", "displacement"),
}


def building_file() -> str:
    """The paper's building with its five sensors, in TOML."""
    levels = [("ground", "ground", None), ("1F", "base", BUILDING.base_mass)]
    levels += [(name, "floor", float(mass)) for name, mass in zip(FLOORS, BUILDING.floor_mass, strict=True)]
    lines = ['code = "PAPER"', 'name = "the paper\'s building"', "[isolation]", "rubber_height = 0.2"]
    for name, role, mass in levels:
        lines += ["[[level]]", f'name = "{name}"', f'role = "{role}"', *([] if mass is None else [f"mass = {mass}"])]
    for channel, (level, quantity) in SENSORS.items():
        lines += ["[[channel]]", f'id = "{channel}"', f'level = "{level}"', 'direction = "x"']
        lines += [f'quantity = "{quantity}"', f"gain = {GAIN}"]
    return "\n".join(lines) + "\n"


def response(scale: float = 1.0) -> tuple[Response, Vector]:
    """Response to AKT013, scaled, and the ground motion itself (m/s²)."""
    ground = akt013() * scale
    return simulate(BUILDING, ISOLATOR, ground, RATE), ground


def records(rng: np.random.Generator, scale: float = 1.0, noise: float = 0.01) -> dict[str, Vector]:
    """(n,) SI units by channel, with white noise of a part of each channel's RMS."""
    moved, ground = response(scale)
    exact = (
        ground,
        moved.base_acceleration,
        moved.floor_acceleration[FOURTH_STOREY],
        moved.floor_acceleration[-1],
        moved.isolator_displacement,
    )
    return {
        channel: samples + noise * float(np.sqrt(np.mean(samples**2))) * rng.standard_normal(samples.size)
        for channel, samples in zip(SENSORS, exact, strict=True)
    }


def miniseed(samples: dict[str, Vector], later: timedelta = timedelta(0)) -> bytes:
    """The records in counts, from START or later."""
    stream = obspy.Stream()
    for channel, values in samples.items():
        network, station, location, code = channel.split(".")
        header = {"network": network, "station": station, "location": location, "channel": code}
        header |= {"starttime": obspy.UTCDateTime(START + later), "sampling_rate": RATE}
        stream.append(obspy.Trace(np.round(values / GAIN).astype(np.int32), header))
    buffer = BytesIO()
    stream.write(buffer, format="MSEED")
    return buffer.getvalue()
