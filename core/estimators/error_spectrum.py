"""How does an estimate err: at which frequencies, and in which patterns?"""

from dataclasses import dataclass, field

import numpy as np

from core.arrays import Matrix, Vector


@dataclass(frozen=True, slots=True, eq=False)
class ErrorSpectrum:
    """Of an estimated history's error."""

    frequency: Vector
    """(k,) Hz, rising."""
    density: Vector
    """(k,) one-sided spectral density of what errs without a pattern, the history's unit squared per Hz."""
    patterns: Matrix = field(default_factory=lambda: np.zeros((0, 0)))
    """(p, n) in the history's unit: what one standard deviation of each of p independent causes does to the history."""
    is_shrunk: bool = False
    """Whether the estimate is a posterior mean, which holds the less of a frequency the less is known of it."""

    def at(self, frequency: Vector) -> Vector:
        """(m,) density at other frequencies in Hz, on straight lines between the given ones, level beyond."""
        return np.asarray(np.interp(frequency, self.frequency, self.density))


@dataclass(frozen=True, slots=True)
class FusedDisplacementError:
    """Of a displacement that a transducer tells below a frequency and accelerometers above it.

    See core.isolation_layer.fusion.
    """

    level: float
    """m²/Hz, towards frequency 0."""
    corner: float
    """Hz, from which on it falls with the fourth power."""

    def at(self, frequency: Vector) -> Vector:
        """(m,) m²/Hz at frequencies in Hz."""
        return np.asarray(self.level / (1 + (frequency / self.corner) ** 4))


def white(std: Vector, band: tuple[float, float]) -> ErrorSpectrum:
    """Of an error that is white within a band (Hz) and whose standard deviation is (n,) std."""
    return ErrorSpectrum(np.array(band), np.full(2, float(np.mean(std**2)) / (band[1] - band[0])))


def of_fused_displacement(displacement_std: float, velocity_std: float) -> FusedDisplacementError:
    """From standard deviations in m and m/s, whose ratio is the corner's angular frequency."""
    corner = velocity_std / displacement_std / (2 * np.pi)
    return FusedDisplacementError(displacement_std**2 * 2 * np.sqrt(2) / (np.pi * corner), corner)
