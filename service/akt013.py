"""The ground motion that every installation has: AKT013, which comes with ObsPy's test data.

NIED's K-NET, Akita, 1996-08-11 03:12 (M 5.9), the east-west component.
"""

from importlib.resources import as_file, files

import obspy

from core.arrays import Vector

PLACE = "io/nied/tests/data/test.knet"
NAME = "Akita 1996, AKT013"


def recorded() -> tuple[Vector, float]:
    """(n,) m/s², the recorded acceleration, and its rate in Hz."""
    with as_file(files("obspy") / PLACE) as path:
        trace = obspy.read(str(path), format="KNET", apply_calib=True)[0]
    return trace.data, float(trace.stats.sampling_rate)
