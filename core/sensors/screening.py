"""Is each channel, looked at alone, fit for use?"""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter

from core.arrays import Vector
from core.description import BuildingDescription
from core.quality import Finding, Severity
from core.record import Channel
from core.sensors.assembly import Trace
from core.sensors.clipping import clipped_samples
from core.sensors.offset import without_jump

MENDED_GAP = 0.1
"""s, the longest gap that interpolation mends."""
SILENT_GAP = 0.03
"""s, the longest gap whose mending cannot be seen in the results."""
SPIKE = 20.0
"""Of the 97th percentile of the distance from the running median nearby: a larger one is no motion."""
MOST_SPIKES = 10
"""In a channel: with more of them it is not mended."""
LARGEST = {"acceleration": 30.0, "velocity": 10.0, "displacement": 2.0, "temperature": 80.0}
"""SI (°C for a temperature): beyond, the unit is wrong."""


def loss(channel: Channel, description: BuildingDescription) -> Severity:
    """How bad it is to be without the channel: nothing can be estimated without the base slab's acceleration."""
    base = channel.level == description.base.name and channel.quantity == "acceleration" and channel.direction != "z"
    beside = [other for other in description.channels if other.id != channel.id and _alike(other, channel)]
    return "fatal" if base and not beside else "warning"


def _alike(channel: Channel, other: Channel) -> bool:
    """Whether two channels measure the same of a level, so that one stands in for the other."""
    return (channel.level, channel.quantity, channel.direction) == (other.level, other.quantity, other.direction)


def screened(trace: Trace, channel: Channel, lost: Severity) -> tuple[Trace | None, tuple[Finding, ...]]:
    """The trace, mended where that is possible, or None if it cannot be used; and what was found.

    Args:
        trace: of the channel, at its own rate.
        channel: which one.
        lost: severity of what makes the channel unusable.
    """
    mended, gaps = _without_gaps(trace, channel, lost)
    if mended is None:
        return None, gaps
    faults = [check(mended, channel, lost) for check in (_dead, _unit, _clipping)]
    found = [finding for finding in faults if finding is not None]
    if found:
        return None, (*gaps, *found)
    smooth, spikes = _without_spikes(mended, channel, lost)
    if smooth is None:
        return None, (*gaps, *spikes)
    level, offsets = without_jump(smooth, channel)
    return level, (*gaps, *spikes, *offsets)


def _without_gaps(trace: Trace, channel: Channel, lost: Severity) -> tuple[Trace | None, tuple[Finding, ...]]:
    absent = ~np.isfinite(trace.samples)
    if not absent.any():
        return trace, ()
    edges = np.flatnonzero(np.diff(np.concatenate([[0], absent.astype(int), [0]])))
    longest = float(np.diff(edges)[::2].max() / trace.rate)
    if longest > MENDED_GAP or absent.mean() > 0.01 or absent[0] or absent[-1]:
        message = (
            f"{absent.sum()} samples are missing or not a number, up to {longest:.3g} s in a row; gaps up to "
            f"{MENDED_GAP} s can be mended. The channel is left out; send the missing data and analyse again"
        )
        return None, (Finding("gap", lost, message, channel.id, longest),)
    position = np.arange(absent.size)
    samples = trace.samples.copy()
    samples[absent] = np.interp(position[absent], position[~absent], samples[~absent])
    message = f"{absent.sum()} missing samples, up to {longest:.3g} s in a row, were interpolated"
    severity: Severity = "note" if longest <= SILENT_GAP else "warning"
    return Trace(trace.start, trace.rate, samples), (Finding("gap", severity, message, channel.id, longest),)


def _dead(trace: Trace, channel: Channel, lost: Severity) -> Finding | None:
    if channel.quantity == "temperature" or np.ptp(trace.samples) > 0:
        return None
    level = float(trace.samples[0])
    message = f"every sample is {level:.4g} (SI); check the sensor and its cable. It is left out"
    return Finding("dead", lost, message, channel.id, level)


def _unit(trace: Trace, channel: Channel, lost: Severity) -> Finding | None:
    centred = trace.samples - (0.0 if channel.quantity == "temperature" else np.median(trace.samples))
    peak, limit = float(np.abs(centred).max()), LARGEST[channel.quantity]
    # A single wild sample is a spike, not a unit: the unit shows in a share of the record.
    if np.quantile(np.abs(centred), 0.999) <= limit:
        return None
    message = (
        f"reaches {peak:.4g} as a {channel.quantity}, more than {limit:g} (SI); check the unit (gal are 0.01 m/s², "
        "g are 9.81 m/s²). It is left out"
    )
    return Finding("unit", lost, message, channel.id, peak)


def _clipping(trace: Trace, channel: Channel, lost: Severity) -> Finding | None:
    centred = trace.samples - np.median(trace.samples)
    clipped = 0 if channel.quantity == "temperature" else clipped_samples(centred)
    if not clipped:
        return None
    level = float(np.abs(centred).max())
    message = (
        f"{clipped} samples lie flat at the largest value, {level:.4g} (SI): the sensor was at its limit. "
        "It is left out; a sensor of larger range would do"
    )
    return Finding("clipping", lost, message, channel.id, level)


def _without_spikes(trace: Trace, channel: Channel, lost: Severity) -> tuple[Trace | None, tuple[Finding, ...]]:
    distance = np.abs(trace.samples - median_filter(trace.samples, 7, mode="nearest"))
    wild = distance > SPIKE * _running_level(distance, trace.rate)
    wild &= distance > 0.1 * np.quantile(np.abs(trace.samples - np.median(trace.samples)), 0.999)
    count = int(wild.sum())
    if channel.quantity == "temperature" or not count:
        return trace, ()
    largest = float(distance[wild].max())
    if count > MOST_SPIKES:
        message = f"{count} spikes up to {largest:.4g} (SI); check the cable. The channel is left out"
        return None, (Finding("spike", lost, message, channel.id, largest),)
    position = np.arange(wild.size)
    samples = trace.samples.copy()
    samples[wild] = np.interp(position[wild], position[~wild], samples[~wild])
    message = f"{count} spikes up to {largest:.4g} (SI) were interpolated; check the cable if they come again"
    return Trace(trace.start, trace.rate, samples), (Finding("spike", "warning", message, channel.id, largest),)


def _running_level(distance: Vector, rate: float) -> Vector:
    """97th percentile of each second and of its neighbours, so that a strong phase is judged by itself."""
    block = max(1, round(rate))
    count = -(-distance.size // block)
    seconds = np.resize(distance, (count, block))
    seconds.ravel()[distance.size :] = distance[-1]
    levels = np.quantile(seconds, 0.97, axis=1)
    around = maximum_filter1d(levels, 3, mode="nearest")
    floor = float(np.median(distance))
    return np.repeat(np.maximum(around, floor), block)[: distance.size]


def missing(channels: Sequence[Channel], present: set[str], description: BuildingDescription) -> tuple[Finding, ...]:
    """What the description lists and the record does not have."""
    return tuple(
        Finding(
            "missing",
            loss(channel, description),
            f"the {channel.quantity} of level {channel.level!r} was not recorded; the event's other file, or a "
            "description without the channel, would do",
            channel.id,
        )
        for channel in channels
        if channel.id not in present
    )
