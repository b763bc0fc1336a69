"""Equivalent stiffness and damping of the isolation layer, segment by segment (paper, eq 24-27)."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class EquivalentSegment:
    """The layer as a spring and a dashpot over one segment of the record."""

    start: float
    """s after the record's start."""
    end: float
    """s after the record's start."""
    amplitude: float
    """m, √2 · RMS of the displacement about its mean (eq 27)."""
    shear_strain: float | None
    """amplitude / rubber height; None where the height is not known."""
    k_eq: float
    """N/m."""
    k_eq_std: float
    c_eq: float
    """N s/m."""
    c_eq_std: float
