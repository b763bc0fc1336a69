"""Exact motion of ground, base slab, layer and floors at any instant, and sensors' records of it."""

from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector

RATE, COUNT = 100.0, 6000
TIME: Vector = np.asarray((np.arange(COUNT) - (COUNT - 1) / 2) / RATE)
"""s, 0 at the record's middle."""
LASTING = 8.0
"""s, of the motion to either side of the middle."""
MODES = (1.3, 3.6, 5.9)
"""Hz, fixed-base."""
ISOLATED = 0.4
"""Hz, below which a layer does not sway."""
SHARES = np.array([[0.8, 0.15, -0.1], [1.3, -0.4, 0.2]])
"""(floors, modes) by which a floor takes part in each mode."""
BLOCK = 80
"""Samples."""
FINE = 16
"""Times the rate, at which motion that is known by its spectrum only is read at other instants."""


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Waves up to 8 Hz under a bell."""

    frequency: Vector
    """(waves,) Hz."""
    amplitude: Vector
    phase: Vector

    @classmethod
    def drawn(cls, rng: np.random.Generator, slope: float, lowest: float = 0.1) -> "Motion":
        """Sixty waves at random from a frequency in Hz on, whose amplitude grows with that power of the frequency."""
        frequency = np.exp(rng.uniform(np.log(lowest), np.log(8.0), 60))
        return cls(frequency, rng.standard_normal(60) * frequency**slope, rng.uniform(0, 2 * np.pi, 60))

    def at(self, time: Vector) -> Vector:
        """(n,) the motion at evenly spaced instants."""
        (waves,) = self._sums(time, np.ones_like(self.frequency)[None])
        return np.asarray(np.exp(-((time / LASTING) ** 2) / 2) * waves)

    def acceleration(self, time: Vector) -> Vector:
        """(n,) its second derivative by time."""
        turn = 2j * np.pi * self.frequency
        waves, slopes, bends = self._sums(time, np.array([np.ones_like(turn), turn, turn**2]))
        slope, bend = -time / LASTING**2, (time / LASTING**2) ** 2 - 1 / LASTING**2
        return np.asarray(np.exp(-((time / LASTING) ** 2) / 2) * (bends + 2 * slope * slopes + bend * waves))

    def _sums(self, time: Vector, factors: np.ndarray) -> Matrix:
        """(sums, n) of all waves, each times its (sums, waves) factors.

        An instant is the start of its block and the time since then: a product of two small matrices takes a thirtieth
        of the time of all waves at all instants.
        """
        step = (time[-1] - time[0]) / (time.size - 1)
        assert np.allclose(np.diff(time), step, rtol=1e-6)
        turn = 2j * np.pi * self.frequency
        blocks = time[0] + BLOCK * step * np.arange(-(-time.size // BLOCK))
        at_blocks = np.exp(turn * blocks[:, None] + 1j * self.phase) * self.amplitude
        since = np.exp(turn[:, None] * step * np.arange(BLOCK))
        return np.array([((at_blocks * own) @ since).real.ravel()[: time.size] for own in factors])


def layer_sensors(rng: np.random.Generator, noise: float, errors: Vector) -> tuple[Vector, Vector, Vector]:
    """Displacement in m, to 0.01 mm, and accelerations of base slab and ground as sensors have them.

    Args:
        rng: of motion and noise.
        noise: of each accelerometer, over its root mean square.
        errors: (6,) logarithm of gain, delay and rate of delay of the base slab, then of the ground.
    """
    relative, ground = Motion.drawn(rng, -2.0), Motion.drawn(rng, 0.0)
    size = 0.02 / relative.at(TIME).std()
    shaking = size * relative.acceleration(TIME).std() / ground.at(TIME).std()
    above, below = (sensor_times(TIME, error) for error in errors.reshape(2, 3))
    base = np.exp(errors[0]) * (size * relative.acceleration(above) + shaking * ground.at(above))
    other = np.exp(errors[3]) * shaking * ground.at(below)
    displacement = size * relative.at(TIME) + 1e-5 * rng.standard_normal(COUNT)
    return displacement, *with_noise(np.array([base, other]), noise, rng)


def floor_sensors(rng: np.random.Generator, noise: float, errors: Vector) -> tuple[Vector, Matrix]:
    """Accelerations of the base slab and of two floors of a superstructure with three modes, from rest."""
    base = Motion.drawn(rng, -1.0).at(TIME)
    late_ones = [
        with_errors(own, error) for own, error in zip(floor_accelerations(base), errors.reshape(-1, 3), strict=True)
    ]
    own, *others = with_noise(np.array([base, *late_ones]), noise, rng)
    return own, np.array(others)


def sensor_times(time: Vector, error: Vector) -> Vector:
    """(n,) s, instants recorded by a sensor with the gain, delay and rate of delay."""
    return np.asarray(time - error[1] - error[2] * time)


def interpolated(samples: Vector, time: Vector) -> Vector:
    """(n,) the band-limited series at other instants."""
    spectrum = np.fft.rfft(np.concatenate([samples, samples[::-1]]))
    count = 2 * samples.size * FINE
    dense = np.fft.irfft(np.pad(spectrum, (0, count // 2 + 1 - spectrum.size)), count)[: samples.size * FINE] * FINE
    return np.interp(time, (np.arange(dense.size) / FINE - (samples.size - 1) / 2) / RATE, dense)


def with_noise(samples: Matrix, noise: float, rng: np.random.Generator) -> Matrix:
    """(channels, n) with white noise of that share of each channel's root mean square."""
    return np.asarray(samples + noise * samples.std(axis=1, keepdims=True) * rng.standard_normal(samples.shape))


def one_earthquake(rng: np.random.Generator, noise: float) -> Matrix:
    """(5, n) what ground, base slab, both floors and the displacement transducer have of one earthquake."""
    relative, shaking = Motion.drawn(rng, -2.0, ISOLATED), Motion.drawn(rng, 0.0)
    size = 0.02 / relative.at(TIME).std()
    ground = size * relative.acceleration(TIME).std() / shaking.at(TIME).std() * shaking.at(TIME)
    base = size * relative.acceleration(TIME) + ground
    displacement = size * relative.at(TIME) + 1e-5 * rng.standard_normal(COUNT)
    return np.vstack([with_noise(np.array([ground, base, *floor_accelerations(base)]), noise, rng), displacement])


def floor_accelerations(base: Vector) -> Matrix:
    """(floors, n) m/s², of a superstructure that was at rest before."""
    frequency, spectrum = np.fft.rfftfreq(2 * COUNT, 1 / RATE), np.fft.rfft(base, 2 * COUNT)
    modes = np.array([frequency**2 / (f**2 - frequency**2 + 0.04j * f * frequency) for f in MODES])
    return np.asarray(np.fft.irfft(spectrum * (1 + SHARES @ modes), 2 * COUNT)[:, :COUNT])


def with_errors(samples: Vector, error: Vector) -> Vector:
    """(n,) as a sensor has it with that logarithm of gain, delay and rate of delay."""
    return np.asarray(np.exp(error[0]) * interpolated(samples, sensor_times(TIME, error)))
