"""Files of records and of stations, written for tests by ObsPy."""

from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path

import numpy as np
import obspy
from obspy.core.inventory import Channel, InstrumentSensitivity, Inventory, Network, Response, Station

START = datetime(2024, 1, 1, 12, 0, 0, 250000, tzinfo=UTC)
CHANNEL = "XX.TOWER.01.HNX"
KNET = Path(obspy.__file__).parent / "io" / "nied" / "tests" / "data" / "test.knet"
"""A real record in K-NET ASCII, which comes with ObsPy."""


def logger_counts(size: int, seed: int = 1) -> np.ndarray:
    """(size,) of a logger."""
    return np.random.default_rng(seed).integers(-100_000, 100_000, size, dtype=np.int32)


def record_file(form: str, *pieces: np.ndarray, channel: str = CHANNEL, gap: float = 10.0) -> bytes:
    """Pieces of one channel at 100 Hz, `gap` seconds apart, in a format of ObsPy's."""
    stream = obspy.Stream()
    start = obspy.UTCDateTime(START)
    for samples in pieces:
        network, station, location, code = channel.split(".")
        header = {"network": network, "station": station, "location": location, "channel": code}
        stream.append(obspy.Trace(samples, header | {"starttime": start, "sampling_rate": 100.0}))
        start += samples.size / 100 + gap
    buffer = BytesIO()
    stream.write(buffer, format=form)
    return buffer.getvalue()


def stationxml(*channels: tuple[str, float, str | None]) -> bytes:
    """StationXML with a channel HNX of XX.TOWER for each location code, sensitivity and unit; None: no response."""
    made = [_channel(*channel) for channel in channels]
    inventory = Inventory([Network("XX", [Station("TOWER", 35.0, 139.0, 0.0, channels=made)])], source="a test")
    buffer = BytesIO()
    inventory.write(buffer, format="STATIONXML")
    return buffer.getvalue()


def _channel(location: str, value: float, unit: str | None) -> Channel:
    response = None
    if unit is not None:
        response = Response(instrument_sensitivity=InstrumentSensitivity(value, 1.0, unit, "COUNTS"))
    return Channel("HNX", location, 35.0, 139.0, 0.0, 0.0, response=response)
