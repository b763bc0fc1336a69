"""Where does a channel rest, and does it stay there?"""

from collections.abc import Mapping

import numpy as np

from core.arrays import Vector
from core.quality import Finding
from core.record import Channel, Quantity
from core.sensors.assembly import Trace
from core.signals.conditioning import position_at_rest

NOTABLE: Mapping[Quantity, float] = {"acceleration": 0.01, "velocity": 0.01, "displacement": 0.001}
"""SI: a channel that rests farther from zero is noted (1 gal, 1 cm/s, 1 mm)."""
SHARE_OF_PEAK = 0.5
"""Of the largest motion: a weak record that rests farther from zero is noted too."""
SMALLEST_JUMP = 0.005
"""m/s² (0.5 gal): a smaller jump of an acceleration's level moves nothing that is estimated."""
BLOCK = 5.0
"""s, of one level."""
SWAY = 0.2
"""Of a block's standard deviation: the mean of 5 s of motion at 0.5 Hz reaches at most √2 / (5 · 0.5 π) of it."""
RESOLUTION = 1e-4
"""Of the record's largest value: no level is known better."""
FEWEST_BLOCKS = 4
"""In a record whose level is judged."""
CERTAIN = 8.0
"""Standard deviations by which the levels before and after must differ."""


def without_jump(trace: Trace, channel: Channel) -> tuple[Trace, tuple[Finding, ...]]:
    """The trace at one resting level; a note where that is far from zero, a warning where an acceleration's jumped.

    A displacement may well rest elsewhere after the event: that is the layer's residual offset, and stays.

    Args:
        trace: of the channel without NaN, at its own rate.
        channel: which one.
    """
    level, jump = trace, None
    if channel.quantity == "acceleration":
        level, jump = _levelled(trace, channel)
    far = _far_from_zero(level, channel) if channel.quantity != "temperature" else None
    return level, tuple(finding for finding in (far, jump) if finding is not None)


def _far_from_zero(trace: Trace, channel: Channel) -> Finding | None:
    rest = position_at_rest(trace.samples, trace.rate)
    if abs(rest) < min(NOTABLE[channel.quantity], SHARE_OF_PEAK * float(np.abs(trace.samples - rest).max())):
        return None
    message = f"rests at {_in_words(rest, channel.quantity)} instead of 0; the offset was taken out"
    return Finding("offset", "note", message, channel.id, rest)


def _levelled(trace: Trace, channel: Channel) -> tuple[Trace, Finding | None]:
    step, block = _step(trace)
    if abs(step) < SMALLEST_JUMP:
        return trace, None
    at = _instant(trace, step, block)
    message = (
        f"its resting level jumped by {_in_words(step, channel.quantity)} {at / trace.rate:.3g} s after its start; the "
        "jump was taken out. Check the sensor's fixing and cable"
    )
    samples = trace.samples - np.where(np.arange(trace.samples.size) < at, 0.0, step)
    return Trace(trace.start, trace.rate, samples), Finding("offset", "warning", message, channel.id, step)


def _step(trace: Trace) -> tuple[float, int]:
    """The step that best explains the levels of the record's blocks, 0 unless it is certain, and its first block."""
    length = max(1, round(BLOCK * trace.rate))
    blocks = trace.samples[: trace.samples.size // length * length].reshape(-1, length)
    if blocks.shape[0] < FEWEST_BLOCKS:
        return 0.0, 0
    levels, precision = blocks.mean(axis=1), _precision(blocks)
    weight, total = np.cumsum(precision), np.cumsum(precision * levels)
    before, after = weight[:-1], weight[-1] - weight[:-1]
    steps = (total[-1] - total[:-1]) / after - total[:-1] / before
    certainty = np.abs(steps) * np.sqrt(before * after / (before + after))
    block = int(np.argmax(certainty))
    return (float(steps[block]), block + 1) if certainty[block] > CERTAIN else (0.0, 0)


def _instant(trace: Trace, step: float, block: int) -> int:
    """Sample at which the level jumps: where the sum of what exceeds the two levels' mean turns (Page, 1954)."""
    length = max(1, round(BLOCK * trace.rate))
    start = (block - 1) * length
    near = trace.samples[start : start + 2 * length]
    middle = np.mean(trace.samples[start - length : start] if start else near[:length]) + step / 2
    return start + int(np.argmin(np.cumsum(np.sign(step) * (near - middle)))) + 1


def _precision(blocks: np.ndarray[tuple[int, int], np.dtype[np.float64]]) -> Vector:
    """(blocks,) 1 / variance of each block's mean as an estimate of the resting level."""
    deviation = SWAY * blocks.std(axis=1) + RESOLUTION * np.abs(blocks - np.median(blocks)).max()
    return np.asarray(1 / np.maximum(deviation, np.finfo(float).tiny ** 0.25) ** 2)


def _in_words(value: float, quantity: Quantity) -> str:
    if quantity == "acceleration":
        return f"{value:.3g} m/s² ({100 * value:.3g} gal)"
    if quantity == "displacement":
        return f"{value:.3g} m ({1000 * value:.3g} mm)"
    return f"{value:.3g} m/s ({100 * value:.3g} cm/s)"
