"""Selection of a building's traces, with checks of their quantity, rate and size."""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from core.record import Channel, Quantity
from service.formats.errors import FormatError
from service.formats.trace import Trace

SI: Mapping[Quantity, str] = {"acceleration": "m/s²", "velocity": "m/s", "displacement": "m", "temperature": "°C"}
LARGEST: Mapping[Quantity, float] = {"acceleration": 50.0, "velocity": 20.0, "displacement": 10.0, "temperature": 200.0}
"""SI: beyond any building's motion; if a tenth of the samples exceed it, the unit is wrong."""
RATES: Mapping[Quantity, tuple[float, float]] = {
    "acceleration": (10.0, 2000.0),
    "velocity": (10.0, 2000.0),
    "displacement": (10.0, 2000.0),
    "temperature": (1e-4, 2000.0),
}
"""Hz, lowest and highest. An isolated building answers between 0.2 and 30 Hz, and its loggers sample at 50 to 500 Hz.

Below 10 Hz the loops of its isolators are lost; no logger of structures is faster than 2000 Hz.
Temperatures may be far apart.
"""


def of_building(traces: Iterable[Trace], channels: Sequence[Channel]) -> tuple[Trace, ...]:
    """The traces of the building's channels.

    Raises:
        FormatError: none is the building's, or one has another quantity, an impossible rate or impossible values.
    """
    known = {channel.id: channel for channel in channels}
    found = tuple(traces)
    kept = tuple(trace for trace in found if trace.channel in known)
    if found and not kept:
        strangers = ", ".join(dict.fromkeys(trace.channel for trace in found))
        raise FormatError(f"no channel of this building: found {strangers}; the building has {', '.join(known)}")
    for trace in kept:
        _check(trace, known[trace.channel])
    return kept


def _check(trace: Trace, channel: Channel) -> None:
    if trace.quantity != channel.quantity:
        raise FormatError(
            f"{channel.id} measures {channel.quantity} according to the building file, but the unit of its records is "
            f"one of {trace.quantity}; correct one of the two"
        )
    lowest, highest = RATES[trace.quantity]
    if not lowest <= trace.rate <= highest:
        raise FormatError(
            f"{channel.id} has {trace.rate:g} samples a second; {lowest:g} to {highest:g} Hz are accepted for "
            f"{trace.quantity}, so the sampling rate of its records must be wrong"
        )
    samples = trace.to_si()
    usual = float(np.quantile(np.abs(samples - np.median(samples)), 0.9))
    if usual > LARGEST[trace.quantity]:
        raise FormatError(
            f"a tenth of the samples of {channel.id} lie more than {usual:.3g} {SI[trace.quantity]} from their median, "
            f"which no building does; the unit or the gain of its records must be wrong"
        )
