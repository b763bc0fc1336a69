"""Conditioning of a recorded history: baseline, pass band, sampling rate and instants."""

from fractions import Fraction
from functools import lru_cache
from typing import TypeVar

import numpy as np
import scipy

from core.arrays import Matrix, Vector
from core.errors import RecordError

Samples = TypeVar("Samples", Vector, Matrix)

QUIET_SHARE = 0.02
"""Share of the record whose beginning counts as the time before the event. A choice: 2 s of 100 s."""
LONGEST_QUIET = 2.0
"""s, longest time before the event that is averaged. Not tuned."""
AT_REST = 0.05
"""Standard deviation of the beginning over that of the record below which the record begins at rest. Not tuned.

Stricter than the limits of core.sensors for a start or a stretch at rest, since the baseline of every estimate follows
from it: there the noise is known and allowed for, or a wrong answer only leaves a sensor unjudged."""
PASSED = 0.8
"""Share of the lower Nyquist frequency that passes unchanged, 40 Hz at 100 Hz; that frequency and above are stopped."""
ATTENUATION = 80.0
"""dB, of the stop band: an alias stays below 1/10000."""
SAME_INSTANT = 1e-3
"""Samples. A delay below it shifts the phase at the highest passed frequency by less than 0.3 %."""
LARGEST_FACTOR = 1000
"""Largest numerator or denominator of the ratio of two rates. A choice; 200/3 Hz to 100 Hz is 3/2."""
SAME_RATE = 1e-5
"""Relative difference within which two rates are the same: 1 ms in 100 s."""


def position_at_rest(samples: Vector, rate: float) -> float:
    """Mean of the time before the event, or of the whole record if it begins in motion.

    Args:
        samples: (n,) without NaN.
        rate: Hz.
    """
    quiet = samples[: quiet_samples(samples.size, rate)]
    at_rest = quiet.std() < AT_REST * samples.std()
    return float(quiet.mean() if at_rest else samples.mean())


def quiet_samples(count: int, rate: float) -> int:
    """Number of samples at the beginning of a record of `count` samples whose mean is its position at rest."""
    return max(1, round(min(QUIET_SHARE * count, LONGEST_QUIET * rate)))


def without_baseline(samples: Vector, rate: float) -> Vector:
    """Samples relative to the position at rest; the residual offset of a displacement after the event remains.

    Args:
        samples: (n,) without NaN.
        rate: Hz.
    """
    return np.asarray(samples - position_at_rest(samples, rate))


def band_passed(samples: Samples, rate: float, band: tuple[float, float]) -> Samples:
    """Samples within the pass band, without delay (Butterworth of order 4, forwards and backwards).

    Both ends of the record are extended by point reflection for two periods of the lowest frequency.

    Args:
        samples: (n,) or (channels, n) without NaN.
        rate: Hz.
        band: Hz, lowest and highest frequency.

    Raises:
        RecordError: the band does not fit the rate, or the record is shorter than two periods of its lowest frequency.
    """
    low, high = band
    if not 0 < low < high < rate / 2:
        raise RecordError(
            f"the band {low:g} to {high:g} Hz does not fit a rate of {rate:g} Hz; it needs 0 < low < high < rate / 2"
        )
    margin = round(2 * rate / low)
    if samples.shape[-1] <= margin:
        seconds = samples.shape[-1] / rate
        raise RecordError(
            f"a record of {seconds:.3g} s is too short for {low:g} Hz; it must be longer than {margin / rate:.3g} s"
        )
    ends = 2 * samples[..., :1], 2 * samples[..., -1:]
    extended = np.concatenate(
        [ends[0] - samples[..., margin:0:-1], samples, ends[1] - samples[..., -2 : -margin - 2 : -1]], axis=-1
    )
    there_and_back = _filtered_once(_filtered_once(extended, rate, band)[..., ::-1], rate, band)[..., ::-1]
    filtered: Samples = there_and_back[..., margin:-margin]
    return filtered


def _filtered_once(samples: Samples, rate: float, band: tuple[float, float]) -> Samples:
    """Forwards, from the steady state of the first sample."""
    steady = _steady_state(rate, *band)
    start = steady.reshape(len(steady), *(1,) * (samples.ndim - 1), 2) * samples[..., :1]
    filtered: Samples = scipy.signal.sosfilt(_sections(rate, *band), samples, axis=-1, zi=start)[0]
    return filtered


def passed_share(frequency: Vector, rate: float, band: tuple[float, float]) -> Vector:
    """(k,) factor by which `band_passed` multiplies components at these frequencies in Hz."""
    _, once = scipy.signal.sosfreqz(_sections(rate, *band), frequency, fs=rate)
    return np.asarray(np.abs(once) ** 2)


@lru_cache(64)  # filters are few, and designing one takes as long as filtering a minute
def _sections(rate: float, low: float, high: float) -> Matrix:
    return np.asarray(scipy.signal.butter(4, (low, high), "bandpass", fs=rate, output="sos"))


@lru_cache(64)
def _steady_state(rate: float, low: float, high: float) -> Matrix:
    """(sections, 2) state of the filter for a constant input of 1."""
    return np.asarray(scipy.signal.sosfilt_zi(_sections(rate, low, high)))


def resampled(samples: Vector, rate: float, new_rate: float, delay: float = 0.0) -> Vector:
    """Samples of the same motion at another rate, the first of them `delay` seconds after the first given one.

    One linear-phase FIR filter (a sinc under a Kaiser window, Oppenheim and Schafer, 2010, section 7.6) stops what the
    lower of the two rates cannot represent, and shifts the samples by the fraction of a sample in the delay. Both ends
    of the record are extended by point reflection, so that the filter meets no step.

    Args:
        samples: (n,) without NaN.
        rate: Hz, of the samples.
        new_rate: Hz, of the result.
        delay: s, not negative.

    Returns:
        As many samples at the new rate as fall within the record.

    Raises:
        RecordError: the ratio of the rates is not a fraction of numbers up to 1000.
    """
    ratio = Fraction(new_rate / rate).limit_denominator(LARGEST_FACTOR)
    if abs(float(ratio) * rate / new_rate - 1) > SAME_RATE or max(ratio.as_integer_ratio()) > LARGEST_FACTOR:
        raise RecordError(
            f"{rate:.6g} Hz cannot be resampled to {new_rate:.6g} Hz: the ratio of the rates must be a fraction of "
            f"numbers up to {LARGEST_FACTOR}"
        )
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
    """Taps at `up` times the rate of the samples, and the index of zero delay.

    Written out, since scipy.signal.firwin has no fractional delay.
    """
    nyquist = 1 / max(up, down)  # of the lower rate, relative to that of the upsampled series
    width = (1 - PASSED) * nyquist
    half = down * int(np.ceil((ATTENUATION - 7.95) / (2.285 * np.pi * width) / 2 / down))
    position = np.arange(-half, half + 1) + fraction * up
    beta = scipy.signal.kaiser_beta(ATTENUATION)
    window = np.i0(beta * np.sqrt(np.clip(1 - (position / (half + 1)) ** 2, 0, None))) / np.i0(beta)
    cutoff = nyquist - width / 2
    taps = cutoff * np.sinc(cutoff * position) * window
    return taps * up / taps.sum(), half


def _filtered(samples: Vector, taps: Vector, centre: int, up: int, down: int) -> Vector:
    """Output of the filter, its first sample at the first given one."""
    margin = down * -(-2 * centre // (up * down))  # a multiple of `down`, as the centre is, which keeps the instants
    padded = np.pad(samples, margin, mode="reflect", reflect_type="odd")
    return np.asarray(scipy.signal.upfirdn(taps, padded, up, down)[(margin * up + centre) // down :])
