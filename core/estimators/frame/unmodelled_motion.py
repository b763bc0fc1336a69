"""Motion that no parameter explains: how strong is it in each band of frequencies, and where is it seen?"""

from dataclasses import dataclass

import numpy as np

from core.arrays import Matrix, Vector
from core.estimators.frame.spectral_lines import Lines
from core.estimators.frame.superstructure_model import Design

DYNAMIC_SHARE = 0.2
"""Of the floors' random motion that acts through the structure; the rest is seen at the sensors alone."""
FIRST_SHARE = 0.01
"""Of the record's power, where the search for the variances begins."""


@dataclass(frozen=True, slots=True, eq=False)
class Variances:
    """Of the motions that no parameter explains, by frequency band."""

    rocking: Vector
    """(bands,) of the base slab's rocking, as acceleration at the roof."""
    floors: Vector
    """(bands,) of accelerations at the floors."""

    @classmethod
    def none(cls, lines: Lines) -> "Variances":
        """Of a superstructure that explains all."""
        return cls(np.zeros(lines.band.max() + 1), np.zeros(lines.band.max() + 1))

    @classmethod
    def first(cls, lines: Lines) -> "Variances":
        """A share of the record's power in each band."""
        count = np.bincount(lines.band)
        power = np.bincount(lines.band, np.mean(np.abs(lines.spectra) ** 2, axis=0))
        share = FIRST_SHARE * power / np.maximum(count, 1)
        return cls(share, share)

    def at(self, lines: Lines) -> Matrix:
        """(2, lines) of the rocking, and of any floor's own motion through the structure."""
        return np.vstack([self.rocking[lines.band], DYNAMIC_SHARE * self.floors[lines.band]])


def static_flexibility(design: Design) -> Matrix:
    """(floors, floors) of the storeys as designed, 1 at the roof."""
    cumulated = np.cumsum(1 / design.storey_stiffness)
    flexibility = np.minimum.outer(cumulated, cumulated)
    return np.asarray(flexibility / flexibility[-1, -1])


def local_covariance(design: Design) -> Matrix:
    """(channels, channels) of a motion seen at sensors alone: the storeys' static flexibility, so that between sensors
    it is interpolated as Guyan (1965) would."""
    flexibility = static_flexibility(design)
    covariance = np.zeros((design.measured.size + 1,) * 2)
    covariance[1:, 1:] = flexibility[np.ix_(design.measured, design.measured)]
    return covariance
