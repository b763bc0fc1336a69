"""What is left of a record once its baseline and all outside the pass band are taken out."""

from typing import TypeVar

import numpy as np
from scipy.signal import butter, sosfiltfilt, sosfreqz

from core.arrays import Matrix, Vector
from core.errors import RecordError

Samples = TypeVar("Samples", Vector, Matrix)

QUIET_SHARE = 0.02
"""Of the record: how much of its beginning stands for the time before the event."""
LONGEST_QUIET = 2.0
"""s, of the time before the event that is averaged."""
AT_REST = 0.05
"""Of the record's RMS: a beginning that moves less is taken for the time before the event."""


def position_at_rest(samples: Vector, rate: float) -> float:
    """Mean of the time before the event; where the record begins in motion, the mean of all.

    Args:
        samples: (n,) without NaN.
        rate: Hz.
    """
    quiet = samples[: quiet_samples(samples.size, rate)]
    at_rest = quiet.std() < AT_REST * samples.std()
    return float(quiet.mean() if at_rest else samples.mean())


def quiet_samples(count: int, rate: float) -> int:
    """Samples of a record's beginning whose mean is its position at rest, of so many at a rate in Hz."""
    return max(1, round(min(QUIET_SHARE * count, LONGEST_QUIET * rate)))


def without_baseline(samples: Vector, rate: float) -> Vector:
    """Samples about the position at rest: the residual offset of a displacement after the event stays.

    Args:
        samples: (n,) without NaN.
        rate: Hz.
    """
    return np.asarray(samples - position_at_rest(samples, rate))


def band_passed(samples: Samples, rate: float, band: tuple[float, float]) -> Samples:
    """Samples within the pass band, without delay (Butterworth of order 4, forwards and backwards).

    At both ends the record is continued by its point reflection for two periods of the lowest frequency.

    Args:
        samples: (n,) or (channels, n) without NaN.
        rate: Hz.
        band: Hz, lowest and highest frequency.

    Raises:
        RecordError: the band does not fit the rate, or the record is shorter than two periods of its lowest frequency.
    """
    low, high = band
    if not 0 < low < high < rate / 2:
        raise RecordError(f"the band {low:g} to {high:g} Hz does not fit {rate:g} Hz; 0 < low < high < rate / 2 would")
    margin = round(2 * rate / low)
    if samples.shape[-1] <= margin:
        seconds = samples.shape[-1] / rate
        raise RecordError(f"a record of {seconds:.3g} s is too short for {low:g} Hz; {margin / rate:.3g} s would do")
    filtered: Samples = sosfiltfilt(_sections(rate, band), samples, axis=-1, padlen=margin)
    return filtered


def passed_share(frequency: Vector, rate: float, band: tuple[float, float]) -> Vector:
    """(k,) by which `band_passed` multiplies what has these frequencies in Hz."""
    _, once = sosfreqz(_sections(rate, band), frequency, fs=rate)
    return np.asarray(np.abs(once) ** 2)


def _sections(rate: float, band: tuple[float, float]) -> Matrix:
    return np.asarray(butter(4, band, "bandpass", fs=rate, output="sos"))
