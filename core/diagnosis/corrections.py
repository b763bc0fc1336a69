"""Correction of faulty sensors in a copy of the samples, so that a diagnosis can go on behind the fault.

Gain, delay, clock, polarity, exchanged channels and drift are corrected. Rotated axes, offsets and jumps of the level
are corrected by every analysis that shows them (core.sensors); rotated axes are then turned back in all earthquakes, by
the median of their angles. A channel with another fault is left out, unless nothing can be estimated without it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import timedelta

import numpy as np
import scipy

from core.analysis import EventAnalysis
from core.arrays import Vector
from core.description import BuildingDescription
from core.diagnosis.sensor_faults import IN_USE, BuildingFault
from core.record import Segment
from core.sensors.resting_level import without_drift
from core.sensors.screening import loss

SMOOTH = 5
"""Degree of the splines between samples: 0.1 % at a quarter of the sampling rate."""


@dataclass(frozen=True, slots=True)
class Correction:
    """Correction of one channel's samples."""

    channel: str
    """Id under which the samples were recorded."""
    measured: str
    """Id of the channel that they belong to."""
    gain: float = 1.0
    """By which the samples are divided."""
    late: float = 0.0
    """s, of the samples in the middle of the record."""
    slow: float = 0.0
    """s/s, by which the samples become later."""
    drifts: bool = False
    """True if the slow change of the level is removed."""
    turned: float = 0.0
    """rad from x towards y, by which the axes of the channel's sensor are turned."""
    is_left_out: bool = False
    """True if the samples are not used."""


def correction(
    fault: BuildingFault, analyses: Sequence[EventAnalysis], description: BuildingDescription
) -> Correction | None:
    """Correction of a sensor's fault; None where none is possible or needed.

    Args:
        fault: of a sensor.
        analyses: of the earthquakes that show it.
        description: of the building.
    """
    channel = fault.channel or ""
    match fault.kind:
        case "gain" if fault.std is not None:
            return Correction(channel, channel, gain=1 + fault.value)
        case "delay":
            return Correction(channel, channel, late=fault.value)
        case "clock":
            return Correction(channel, channel, late=fault.late, slow=fault.value)
        case "polarity":
            return Correction(channel, channel, gain=-1.0)
        case "drift":
            return Correction(channel, channel, drifts=True)
        case "rotation" if _is_turned_back(channel, analyses):
            return Correction(channel, channel, turned=fault.value)
        case "swap":
            other = _exchanged(channel, analyses)
            return None if other is None else Correction(channel, other)
        case kind if kind in IN_USE and _is_dispensable(channel, description):
            return Correction(channel, channel, is_left_out=True)
    return None


def corrected(segments: Sequence[Segment], corrections: Sequence[Correction]) -> tuple[Segment, ...]:
    """The segments of an earthquake after corrections that were found together."""
    every = tuple(segments)
    for one in corrections:
        every = tuple(made for segment in every if (made := _corrected(segment, one)) is not None)
    exchanged = {one.channel: one.measured for one in corrections if one.measured != one.channel}
    return tuple(replace(one, channel=exchanged.get(one.channel, one.channel)) for one in every)


def turned_axes(description: BuildingDescription, corrections: Sequence[Correction]) -> BuildingDescription:
    """The description with the axes of the sensors as they were found."""
    turned = {one.channel: one.turned for one in corrections}
    channels = tuple(
        replace(one, rotation=one.rotation + turned[one.id]) if turned.get(one.id) else one
        for one in description.channels
    )
    return replace(description, channels=channels)


def _corrected(segment: Segment, wanted: Correction) -> Segment | None:
    if segment.channel != wanted.channel:
        return segment
    if wanted.is_left_out:
        return None
    samples, start = segment.samples / wanted.gain, segment.start
    whole = bool(np.isfinite(samples).all())
    if wanted.drifts and whole:
        samples = without_drift(samples, segment.rate)
    if wanted.slow and whole:
        samples = _at_even_times(samples, wanted.slow)
    return replace(segment, start=start - timedelta(seconds=wanted.late), samples=samples)


def _at_even_times(samples: Vector, slow: float) -> Vector:
    """(n,) samples of a clock that becomes later by `slow` s/s, at the times of one that does not; right mid-record."""
    place = np.arange(samples.size)
    late = slow * (place - (samples.size - 1) / 2)
    between = scipy.interpolate.make_interp_spline(place, samples, k=SMOOTH)
    return np.asarray(between(np.clip(place + late, 0, samples.size - 1)))


def _exchanged(channel: str, analyses: Sequence[EventAnalysis]) -> str | None:
    """The channel with which it is exchanged, where one earthquake or more names the two."""
    for analysis in analyses:
        pair = [one.channel for one in analysis.quality if one.kind == "swapped" and one.value == 1.0]
        if len(pair) == 2 and channel in pair:
            return next(name for name in pair if name != channel)
    return None


def _is_turned_back(channel: str, analyses: Sequence[EventAnalysis]) -> bool:
    """True if one of several earthquakes is used with the channel's axes turned back; mirrored ones are left out."""
    return len(analyses) > 1 and any(
        here.record is not None
        and any(one.id == channel for one in here.record.channels)
        and any(one.kind == "rotation" and one.channel == channel for one in here.quality)
        for here in analyses
    )


def _is_dispensable(channel: str, description: BuildingDescription) -> bool:
    return any(one.id == channel and loss(one, description) != "fatal" for one in description.channels)
