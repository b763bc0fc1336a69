"""The same motion at another sampling rate, and at other instants."""

from fractions import Fraction

import numpy as np
from scipy.signal import upfirdn

from core.arrays import Vector
from core.errors import RecordError

PASSED = 0.8
"""Of the lower Nyquist frequency: what passes unchanged, 40 Hz for 100 Hz; all above that frequency is stopped."""
ATTENUATION = 80.0
"""dB, in the stop band: an alias stays below 1/10000."""
SAME_INSTANT = 1e-3
"""Samples: a delay below this shifts the phase at the highest passed frequency by less than 0.3 %."""
LARGEST_FACTOR = 1000
"""Of the ratio of two rates, as a fraction; 200 / 3 Hz to 100 Hz is 3 / 2."""


def resampled(samples: Vector, rate: float, new_rate: float, delay: float = 0.0) -> Vector:
    """Samples of the same motion at another rate, the first of them `delay` seconds after the first one given.

    One linear-phase FIR filter (a sinc under a Kaiser window, Oppenheim and Schafer, 2010, section 7.6) stops what
    the lower of the two rates cannot show and moves the samples by the fraction of a sample that the delay asks for.
    At both ends the record is continued by its point reflection, so that no step is filtered.

    Args:
        samples: (n,) without NaN.
        rate: Hz, theirs.
        new_rate: Hz, wanted.
        delay: s, not negative.

    Returns:
        As many samples at the new rate as fall within the record.

    Raises:
        RecordError: the ratio of the rates is no fraction of numbers up to 1000.
    """
    ratio = Fraction(new_rate / rate).limit_denominator(LARGEST_FACTOR)
    if abs(float(ratio) * rate / new_rate - 1) > 1e-5 or max(ratio.numerator, ratio.denominator) > LARGEST_FACTOR:
        raise RecordError(f"{rate:.6g} Hz cannot be brought to {new_rate:.6g} Hz; a rate of round numbers would do")
    up, down = ratio.numerator, ratio.denominator
    whole = int(delay * rate + SAME_INSTANT)
    fraction = delay * rate - whole
    rest = samples[whole:]
    if up == down and abs(fraction) <= SAME_INSTANT:
        return rest.copy()
    count = int((rest.size - 1 - max(fraction, 0.0)) * up / down + 1e-6) + 1
    taps, centre = _filter(up, down, fraction)
    return _filtered(rest, taps, centre, up, down)[:count]


def _filter(up: int, down: int, fraction: float) -> tuple[Vector, int]:
    """Taps at `up` times the rate of the samples, and the index that stands for no delay."""
    nyquist = 1 / max(up, down)  # of the lower rate, relative to that of the upsampled series
    width = (1 - PASSED) * nyquist
    half = down * int(np.ceil((ATTENUATION - 7.95) / (2.285 * np.pi * width) / 2 / down))
    position = np.arange(-half, half + 1) + fraction * up
    beta = 0.1102 * (ATTENUATION - 8.7)
    window = np.i0(beta * np.sqrt(np.clip(1 - (position / (half + 1)) ** 2, 0, None))) / np.i0(beta)
    cutoff = nyquist - width / 2
    taps = cutoff * np.sinc(cutoff * position) * window
    return taps * up / taps.sum(), half


def _filtered(samples: Vector, taps: Vector, centre: int, up: int, down: int) -> Vector:
    """The filter's output, its first sample at the first sample given."""
    margin = down * -(-2 * centre // (up * down))  # a multiple of `down`, as the centre is: the instants are kept
    padded = np.pad(samples, margin, mode="reflect", reflect_type="odd")
    return np.asarray(upfirdn(taps, padded, up, down)[(margin * up + centre) // down :])
