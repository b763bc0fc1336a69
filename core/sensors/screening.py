"""Screening of single channels: gaps, dead sensors, wrong units, clipping, spikes and offsets."""

from collections.abc import Sequence

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter

from core.arrays import Mask, Vector
from core.description import BuildingDescription
from core.record import Channel, Finding, Severity, Trace
from core.sensors.filled_gaps import FilledGap, filled_gaps, without_fill
from core.sensors.resting_level import without_jump

MENDED_GAP = 0.1
"""s, longest gap that is interpolated. A choice: a tenth of the period of 1 Hz."""
MENDED_SHARE = 0.01
"""Share of missing samples up to which gaps are interpolated. Not tuned."""
SILENT_GAP = 0.03
"""s, longest gap whose interpolation does not show in the results. A choice: three samples at 100 Hz."""
SPIKE = 20.0
"""Distance from the running median, over the 97th percentile of the distances nearby, above which a sample is a spike.
Not tuned."""
SPIKE_SHARE = 0.1
"""Smallest spike over the record's largest motion (its 99.9th percentile). Not tuned."""
SPIKE_WINDOW = 7
"""Samples of the running median: a spike of up to three samples does not affect it."""
MOST_SPIKES = 10
"""Spikes of a channel that are interpolated at most. Not tuned."""
LARGEST = {"acceleration": 30.0, "velocity": 10.0, "displacement": 2.0, "temperature": 80.0}
"""SI units (°C for a temperature), largest plausible values; beyond, the unit is wrong. Not tuned."""
RUN = 3
"""Successive samples at a channel's largest value, which no analogue signal has. Not tuned."""
RESOLVED = 50
"""Largest value in steps of the digitiser, below which a run of equal samples is only coarse. Not tuned."""
HIDDEN = 5.0
"""Steps of the digitiser by which a motion may fall within a run of equal samples: the sensor's own noise is one."""
VISITS = 3
"""Separate peaks that end at the very same value, which a finely resolved motion does not have either. Not tuned."""
FINE = 1e4
"""Largest value in steps of the digitiser, above which peaks of equal height are not due to resolution. Not tuned."""
APART = 0.9
"""Share of the largest value below which the channel falls between two separate peaks. Not tuned."""
LIMIT_SHARE = 0.2
"""Smallest value of a limit over the channel's whole range. Not tuned."""
SMALLEST_STEPS = 0.01
"""Quantile of the changes from sample to sample that is the step of the digitiser; interpolated samples are finer. A
choice."""


def loss(channel: Channel, description: BuildingDescription) -> Severity:
    """Severity of losing the channel: without the base slab's acceleration, no force can be estimated."""
    base = channel.level == description.base.name and channel.quantity == "acceleration" and channel.direction != "z"
    beside = [other for other in description.channels if other.id != channel.id and _alike(other, channel)]
    return "fatal" if base and not beside else "warning"


def _alike(channel: Channel, other: Channel) -> bool:
    """True if two channels measure the same quantity of a level, so that one can replace the other."""
    return (channel.level, channel.quantity, channel.direction) == (other.level, other.quantity, other.direction)


def missing(channels: Sequence[Channel], present: set[str], description: BuildingDescription) -> tuple[Finding, ...]:
    """A finding for each channel of the description that was not recorded."""
    return tuple(
        Finding(
            "missing",
            loss(channel, description),
            f"the {channel.quantity} of level {channel.level!r} was not recorded; send the event's other file, or "
            "remove the channel from the description",
            channel.id,
        )
        for channel in channels
        if channel.id not in present
    )


def screened(trace: Trace, channel: Channel, lost: Severity) -> tuple[Trace | None, tuple[Finding, ...]]:
    """The trace, mended where possible, or None if it cannot be used; and the findings.

    Args:
        trace: of the channel, at its own rate.
        channel: its description.
        lost: severity of findings that make the channel unusable.
    """
    filled = filled_gaps(trace, channel.quantity)
    mended, gaps = _without_gaps(without_fill(trace, filled), channel, lost, filled)
    if mended is None:
        return None, gaps
    faults = [check(mended, channel, lost) for check in (_dead, _unit, _clipping)]
    findings = [finding for finding in faults if finding is not None]
    if findings:
        return None, (*gaps, *findings)
    smooth, spikes = _without_spikes(mended, channel, lost)
    if smooth is None:
        return None, (*gaps, *spikes)
    level, offsets = without_jump(smooth, channel)
    return level, (*gaps, *spikes, *offsets)


def _without_gaps(
    trace: Trace, channel: Channel, lost: Severity, filled: Sequence[FilledGap]
) -> tuple[Trace | None, tuple[Finding, ...]]:
    absent = ~np.isfinite(trace.samples)
    if not absent.any():
        return trace, ()
    edges = np.flatnonzero(np.diff(np.concatenate([[0], absent.astype(int), [0]])))
    longest = float(np.diff(edges)[::2].max() / trace.rate)
    if longest > MENDED_GAP or absent.mean() > MENDED_SHARE or absent[0] or absent[-1]:
        message = (
            f"{absent.sum()} samples are missing or not a number, up to {longest:.3g} s in a row; only gaps up to "
            f"{MENDED_GAP} s are interpolated. The channel is left out; send the missing data and analyse again"
        )
        if filled:
            message = (
                f"{absent.sum()} samples were not measured, up to {longest:.3g} s in a row: the recorder lost them and "
                f"wrote {_fill(filled)} in their place; only gaps up to {MENDED_GAP} s are interpolated. The channel "
                "is left out; send the missing data and analyse again"
            )
        return None, (Finding("gap", lost, message, channel.id, longest),)
    message = f"{absent.sum()} missing samples, up to {longest:.3g} s in a row, were interpolated"
    if filled:
        message = (
            f"{absent.sum()} samples, up to {longest:.3g} s in a row, were interpolated: the recorder lost them and "
            f"wrote {_fill(filled)} in their place"
        )
    severity: Severity = "note" if longest <= SILENT_GAP else "warning"
    finding = Finding("gap", severity, message, channel.id, longest)
    return Trace(trace.start, trace.rate, _interpolated(trace.samples, absent)), (finding,)


def _fill(filled: Sequence[FilledGap]) -> str:
    """Values that the recorder wrote in place of lost samples, in words."""
    return " and ".join(dict.fromkeys(one.kind for one in filled))


def _interpolated(samples: Vector, absent: Mask) -> Vector:
    position, mended = np.arange(samples.size), samples.copy()
    mended[absent] = np.interp(position[absent], position[~absent], samples[~absent])
    return mended


def _dead(trace: Trace, channel: Channel, lost: Severity) -> Finding | None:
    if channel.quantity == "temperature" or np.ptp(trace.samples) > 0:
        return None
    level = float(trace.samples[0])
    message = f"every sample is {level:.4g} (SI); check the sensor and its cable. The channel is left out"
    return Finding("dead", lost, message, channel.id, level)


def _unit(trace: Trace, channel: Channel, lost: Severity) -> Finding | None:
    centred = trace.samples - (0.0 if channel.quantity == "temperature" else np.median(trace.samples))
    peak, limit = float(np.abs(centred).max()), LARGEST[channel.quantity]
    # A single wild sample is a spike; a wrong unit shows in a share of the record.
    if peak <= limit or np.quantile(np.abs(centred), 0.999) <= limit:
        return None
    message = (
        f"reaches {peak:.4g} as a {channel.quantity}, more than {limit:g} (SI); check the unit (gal are 0.01 m/s², "
        "g are 9.81 m/s²). The channel is left out"
    )
    return Finding("unit", lost, message, channel.id, peak)


def _clipping(trace: Trace, channel: Channel, lost: Severity) -> Finding | None:
    centred = trace.samples - np.median(trace.samples)
    clipped = 0 if channel.quantity == "temperature" else clipped_samples(centred)
    if not clipped:
        return None
    level = float(np.abs(centred).max())
    message = (
        f"{clipped} samples lie flat at the largest value, {level:.4g} (SI): the sensor reached its limit. "
        "The channel is left out; use a sensor with a larger range"
    )
    return Finding("clipping", lost, message, channel.id, level)


def clipped_samples(samples: Vector) -> int:
    """Number of samples that lie flat at the channel's largest or smallest value; 0 if it is not clipped.

    A smooth motion that turns within a run of equal samples falls, from the middle of the run to its ends, by an amount
    that follows from its curvature. A run at the largest value is coarse if that is a few steps of the digitiser, and
    clipped if it is more. A finely resolved motion does not come to the same largest value repeatedly either.

    Args:
        samples: (n,) without NaN, relative to the channel's position at rest.
    """
    changes = np.abs(np.diff(samples))
    step = float(np.quantile(changes[changes > 0], SMALLEST_STEPS)) if changes.any() else np.inf
    upward = (samples, -samples)
    limits = (float(side.max()) for side in upward)
    return sum(
        _at_limit(side, limit, step)
        for side, limit in zip(upward, limits, strict=True)
        if limit > max(RESOLVED * step, LIMIT_SHARE * float(np.ptp(samples)))
    )


def _at_limit(samples: Vector, limit: float, step: float) -> int:
    """Number of samples at the upper limit; 0 if they do not show that it is the sensor's."""
    there = samples >= limit - 1e-9 * limit
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(int), [0]]))).reshape(-1, 2)
    cut = any(
        stop - start >= RUN and _fall(samples, start, stop) > HIDDEN * step
        for start, stop in edges
        if start >= 2 and stop <= samples.size - 2
    )
    fallen = np.concatenate([[0], np.cumsum(samples < APART * limit)])
    visits = np.unique(fallen[edges[:, 0]]).size
    return int(there.sum()) if cut or (visits >= VISITS and limit > FINE * step) else 0


def _fall(samples: Vector, start: int, stop: int) -> float:
    """Fall within half of the run [start, stop) of a parabola with the slopes just outside."""
    rise, fall = samples[start - 1] - samples[start - 2], samples[stop] - samples[stop + 1]
    length = stop - start
    curvature = (rise + fall) / (length + 2)
    return float(curvature * (length - 1) ** 2 / 8)


def _without_spikes(trace: Trace, channel: Channel, lost: Severity) -> tuple[Trace | None, tuple[Finding, ...]]:
    distance = np.abs(trace.samples - median_filter(trace.samples, SPIKE_WINDOW, mode="nearest"))
    wild = distance > SPIKE * _running_level(distance, trace.rate)
    if wild.any():
        wild &= distance > SPIKE_SHARE * np.quantile(np.abs(trace.samples - np.median(trace.samples)), 0.999)
    count = int(wild.sum())
    if channel.quantity == "temperature" or not count:
        return trace, ()
    largest = float(distance[wild].max())
    if count > MOST_SPIKES:
        message = f"{count} spikes up to {largest:.4g} (SI); check the cable. The channel is left out"
        return None, (Finding("spike", lost, message, channel.id, largest),)
    message = f"{count} spikes up to {largest:.4g} (SI) were interpolated; check the cable if they recur"
    finding = Finding("spike", "warning", message, channel.id, largest)
    return Trace(trace.start, trace.rate, _interpolated(trace.samples, wild)), (finding,)


def _running_level(distance: Vector, rate: float) -> Vector:
    """(n,) 97th percentile of each second and its neighbours, so that a strong phase is compared with itself."""
    block = max(1, round(rate))
    count = -(-distance.size // block)
    seconds = np.resize(distance, (count, block))
    seconds.ravel()[distance.size :] = distance[-1]
    levels = np.quantile(seconds, 0.97, axis=1)
    around = maximum_filter1d(levels, 3, mode="nearest")
    floor = float(np.median(distance))
    return np.repeat(np.maximum(around, floor), block)[: distance.size]
