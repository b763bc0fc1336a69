"""Worth of an effect: the share of a model's excess error that it takes, where the model was fitted and where it was
held out.

The excess error is what a model leaves beyond the noise, as power, each record by its own noise. Evidence (ΔBIC) says
how certain it is that an effect takes something; in long records it is overwhelming where the effect takes next to
nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from core.arrays import Vector
from core.fitting.data import FitData
from core.fitting.fit import residual_at, rms_by_record
from core.fitting.noise import noise_rms, pooled_rms
from core.fitting.observation import Observation
from core.model.isolator import Isolator

EARNS = 0.5
"""Smallest share of the excess error that a named effect takes where it was fitted, beside the others. Chosen, as the
next, on 35 trials of benchmarks.diagnosis with seed 0."""
EARNS_HELD_OUT = 0.25
"""The same on held-out records, whose noise is known less well."""
TESTED = 1.25
"""Noise ratio of the model without an effect from which on held-out records test the effect: below it they do not show
that anything is missing."""


def excess(noise_ratio: float, floor: float = 1.0) -> float:
    """Power of the error beyond the noise, over the noise's.

    Args:
        noise_ratio: of the error.
        floor: noise ratio that noise alone makes.
    """
    return max(noise_ratio**2 - floor**2, 0.0)


@dataclass(frozen=True, slots=True)
class NoiseRatios:
    """Errors of a model's force over the errors that noise alone makes."""

    fitted: float
    held_out: float | None
    """None where nothing is held out."""


@dataclass(frozen=True, slots=True)
class Worth:
    """Shares of the excess error that an effect, or all of them, takes."""

    fitted: float
    held_out: float | None
    """None where nothing is held out, or where the held-out records need no effect."""

    @property
    def earns_a_name(self) -> bool:
        """True if the share is large enough wherever it is known."""
        return self.fitted >= EARNS and (self.held_out is None or self.held_out >= EARNS_HELD_OUT)


def worth(without: NoiseRatios, after: NoiseRatios) -> Worth:
    """Shares of the excess error of the model without an effect that the model with it takes away."""
    return Worth(_taken(without.fitted, after.fitted), _taken_held_out(without.held_out, after.held_out))


def _taken(without: float, after: float) -> float:
    """Noise whose size is overrated leaves less than one: then that is the floor."""
    floor = min(1.0, after, without)
    before = excess(without, floor)
    return 1 - excess(after, floor) / before if before > 0 else 0.0


def _taken_held_out(without: float | None, after: float | None) -> float | None:
    if without is None or after is None or max(without, after) < TESTED:
        return None
    return _taken(without, after) if without > 1 else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Judge:
    """All records, fitted and held out, in the order of their times, weighed by their noise."""

    data: FitData
    is_held_out: Vector
    """(records,) of truth values."""

    @classmethod
    def of(cls, fitted: Sequence[Observation], held_out: Sequence[Observation]) -> "Judge":
        """The records of a diagnosis."""
        seen = sorted([*fitted, *held_out], key=lambda one: one.start)
        out = {id(one) for one in held_out}
        return cls(FitData.by_noise(seen), np.array([id(one) in out for one in seen]))

    def noise_ratios(self, model: Isolator) -> NoiseRatios:
        """Noise ratios of a model at its values; infinite where its force grows beyond all bounds."""
        data = self.data
        floor, samples = np.array([(noise_rms(one), one.count) for one in data.whitenings]).T
        ratios = rms_by_record(data, residual_at(data, model)) / floor
        fitted, held_out = (
            float(np.nan_to_num(pooled_rms(ratios[kept], samples[kept]), nan=np.inf)) if kept.any() else None
            for kept in (np.logical_not(self.is_held_out), self.is_held_out)
        )
        return NoiseRatios(np.inf if fitted is None else fitted, held_out)
