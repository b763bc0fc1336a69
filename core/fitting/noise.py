"""Noise of a residual: the error of an estimated force, and of the motion that drives a model, in a right model's
residual.

Fits, comparisons and diagnoses all measure a residual against this noise, so that a model has one noise ratio in each
record: about 1 if the model is right (0.95 to 1 where only white noise was added; 0.33 to 1.17 in 32 records of
simulated buildings, as the patterns of their error may be smaller than assumed). The ratio covers the frequencies
at which the noise is known, leaves out the ends of a record that begins or ends in motion, and removes the known
patterns of the force's error.

The motion's error counts as what it does to the force of a law with the layer's tangent stiffness
(core.fitting.tangent). A delay between force and motion is a pattern, the force's rate: in a layer that stiffens or
yields it looks like damping, and no effect is supported by it alone.
"""

from collections.abc import Callable
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from core.arrays import Matrix, Vector
from core.estimators.result import ErrorSpectrum, fused_displacement_error, white
from core.fitting.observation import LayerHistory, Observation
from core.fitting.tangent import tangent
from core.signals.whitening import BAND, Whitening, shrunk, whitening

EDGE = 0.5
"""s, length of either end of a record, by which its strength is judged. A choice."""
AT_REST = 0.01
"""Strength of an end over that of the strongest stretch, below which the record is at rest there. A choice."""
IGNORED, FADED = 5.0, 15.0
"""s from an end in motion: nothing is used up to the first, everything beyond the second. In simulated records the
force there errs by up to 13 %, 2 % and 0.5 % of its root mean square in the first, second and third five seconds."""
LONGEST = 0.25
"""Largest share of the record that is lost so at either end. A choice."""
LEAST_NOISE = 1e-6
"""Smallest noise over the root mean square of the force: a smaller one, or none, is not credible."""
LEAST_SAMPLE = 1e-3
"""Smallest noise of a sample over that of its record. A choice."""

TIMING_STD = 2e-4
"""s, standard deviation of the delay between the clocks of the accelerations, which give the force, and of the motion.

No building file says which channels share a clock. A delay of several deviations is still one pattern among thousands
of coefficients. Chosen on even seeds of benchmarks.diagnosis: with 1 ms, that of sound sensors, the damping is too
uncertain for a wrong mass to show at 10 % noise."""


@dataclass(frozen=True, slots=True, eq=False)
class ForceNoise:
    """Noise in the residual of a right model of one record."""

    whitening: Whitening
    std: Vector
    """(n,) N, standard deviation of each sample, tapered; its mean square is that of the coefficients."""

    @property
    def rms(self) -> float:
        """N, root mean square of the noise."""
        return noise_rms(self.whitening)

    def residual(self, force: Vector, model: Vector) -> Vector:
        """(n,) N, the part of a residual whose noise is known.

        Args:
            force: (n,) N, as estimated.
            model: (n,) N, the model's force, unfiltered.
        """
        coefficients = self.whitening.coefficients(force[None])[0] - self.whitening.filtered(model[None])[0]
        return self.whitening.history(self.whitening.whitened(coefficients[None])[0] * self.whitening.std)


def noise_rms(weights: Whitening) -> float:
    """N, root mean square of the noise over the samples of a record."""
    return float(np.linalg.norm(weights.std) / np.sqrt(weights.count))


def pooled_rms(each: Vector, samples: Vector) -> float:
    """Root mean square over several records, of those of each; of noise ratios, the ratio over all records."""
    return float(np.sqrt(np.sum(samples * each**2) / np.sum(samples)))


def force_noise(observation: Observation) -> ForceNoise:
    """Noise in the residual of a right model of an observation; computed once for as long as the observation exists."""
    known = _KNOWN.get(observation)
    if known is None:
        known = _KNOWN[observation] = _force_noise(observation)
    return known


_KNOWN: WeakKeyDictionary[Observation, ForceNoise] = WeakKeyDictionary()
"""By identity: every fit and every comparison of a diagnosis needs the same ones."""


def _force_noise(observation: Observation) -> ForceNoise:
    layer, rate = observation.layer, observation.rate
    error, taper = layer.force_error or _white_error(layer, rate), edge_taper(layer.force, rate)
    least, patterns = _least_density(layer, rate), _patterns(layer, rate, error)

    def weights_with(motion: Callable[[Vector], Vector]) -> Whitening:
        weights = whitening(
            layer.force,
            rate,
            lambda f: np.maximum(error.at(f) + motion(f), least),
            patterns=patterns,
            passed=layer.band,
            window=taper,
        )
        return shrunk(weights, layer.force, error.at) if error.is_shrunk else weights

    weights = weights_with(np.zeros_like)
    if layer.displacement_std is None or not np.ptp(layer.displacement) or not layer.force.any():
        return ForceNoise(weights, _std(layer.force_std, taper, noise_rms(weights)))
    law = tangent(layer, rate, weights)
    weights = weights_with(_by_motion(layer, layer.displacement_std, rate, law.mean_square(taper)))
    course = np.hypot(layer.force_std, law.stiffness * layer.displacement_std)
    return ForceNoise(weights, _std(course, taper, noise_rms(weights)))


def _patterns(layer: LayerHistory, rate: float, error: ErrorSpectrum) -> Matrix:
    """(p, n) N, effects on the force of independent causes: those of its estimate, and a delay against the motion."""
    late = TIMING_STD * rate * np.gradient(layer.force)[None]
    return np.concatenate([error.patterns, late]) if error.patterns.size else late


def _white_error(layer: LayerHistory, rate: float) -> ErrorSpectrum:
    """Error of a force without a spectrum: white within the force's band, or within BAND where that is not known."""
    low, high = layer.band or BAND
    return white(layer.force_std, (low, min(high, rate / 2)))


def _least_density(layer: LayerHistory, rate: float) -> float:
    """N²/Hz; of 1 N where the layer does nothing."""
    least = LEAST_NOISE * float(np.sqrt(np.mean(layer.force**2))) or 1.0
    return least**2 / (rate / 2)


def _by_motion(
    layer: LayerHistory, displacement_std: Vector, rate: float, stiffness: Callable[[Vector], Vector]
) -> Callable[[Vector], Vector]:
    """N²/Hz at frequencies in Hz, error of a model's force by that of the motion that drives it.

    Args:
        layer: whose motion it is.
        displacement_std: (n,) m, of its error.
        rate: Hz.
        stiffness: (N/m)² at frequencies in Hz, mean square of the law's tangent.
    """
    std = float(np.median(displacement_std))
    if layer.velocity_std is None:
        return lambda frequency: stiffness(frequency) * (std**2 / (rate / 2))
    motion = fused_displacement_error(std, float(np.median(layer.velocity_std)))
    return lambda frequency: np.asarray(stiffness(frequency) * motion.at(frequency))


def _std(course: Vector, taper: Vector, rms: float) -> Vector:
    """(n,) N, noise of each sample: in the course of (n,) standard deviations, with the mean square of rms."""
    course = np.asarray(course * taper)
    course = np.maximum(course / (float(course.max()) or 1.0), LEAST_SAMPLE)
    return np.asarray(course * rms / np.sqrt(np.mean(course**2)))


def edge_taper(force: Vector, rate: float) -> Vector:
    """(n,) from 0 to 1; 1 everywhere for a record that begins and ends at rest.

    Args:
        force: (n,) N.
        rate: Hz.
    """
    window, count = np.ones(force.size), max(1, round(EDGE * rate))
    power = np.convolve(force**2, np.full(count, 1 / count), mode="valid")
    ignored, faded = (min(1.0, LONGEST * force.size / rate / FADED) * one for one in (IGNORED, FADED))
    along = np.clip((np.arange(force.size) / rate - ignored) / (faded - ignored), 0, 1)
    rising = np.sin(np.pi / 2 * along) ** 2
    for end, shape in ((power[0], rising), (power[-1], rising[::-1])):
        if end > AT_REST**2 * power.max():
            window *= shape
    return window
