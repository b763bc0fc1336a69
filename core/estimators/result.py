"""Results of an estimator: the restoring force, its errors, and how far its assumptions hold."""

from dataclasses import dataclass, field

import numpy as np

from core.arrays import Matrix, Vector
from core.building import FixedBaseModes
from core.identification.modes import Mode
from core.record import Direction, Finding

EXPLAINED = 2.0
"""Chi-square per degree of freedom above which an engineer should know that the model is not the building. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class ErrorSpectrum:
    """Error of an estimated history by frequency."""

    frequency: Vector
    """(k,) Hz, rising."""
    density: Vector
    """(k,) one-sided spectral density of the error without a pattern, the history's unit squared per Hz."""
    patterns: Matrix = field(default_factory=lambda: np.zeros((0, 0)))
    """(p, n) in the history's unit: effect on the history of one standard deviation of each of p independent causes."""
    is_shrunk: bool = False
    """True of a posterior mean, which holds less of a frequency where less is known of it."""

    def at(self, frequency: Vector) -> Vector:
        """(m,) density at other frequencies in Hz, on straight lines between the given ones, level beyond."""
        return np.asarray(np.interp(frequency, self.frequency, self.density))


@dataclass(frozen=True, slots=True)
class FusedDisplacementError:
    """Error of a displacement fused from a transducer, below the corner, and accelerometers, above it.

    See core.isolation_layer.fusion.
    """

    level: float
    """m²/Hz, towards frequency 0."""
    corner: float
    """Hz, above which it falls with the fourth power."""

    def at(self, frequency: Vector) -> Vector:
        """(m,) m²/Hz at frequencies in Hz."""
        return np.asarray(self.level / (1 + (frequency / self.corner) ** 4))


def white(std: Vector, band: tuple[float, float]) -> ErrorSpectrum:
    """Spectrum of an error that is white within a band (Hz), of (n,) standard deviation std."""
    return ErrorSpectrum(np.array(band), np.full(2, float(np.mean(std**2)) / (band[1] - band[0])))


def fused_displacement_error(displacement_std: float, velocity_std: float) -> FusedDisplacementError:
    """Error spectrum from standard deviations in m and m/s, whose ratio is the corner's angular frequency."""
    corner = velocity_std / displacement_std / (2 * np.pi)
    return FusedDisplacementError(displacement_std**2 * 2 * np.sqrt(2) / (np.pi * corner), corner)


@dataclass(frozen=True, slots=True)
class Assessment:
    """Assumptions of an estimator, and how far they hold on a record."""

    assumption: str
    """Assumption about superstructure and sensors that the record supports, for display."""
    chi_square: float | None
    """Chi-square per degree of freedom of the calibration by noise alone: about 1 where noise explains the misfit; None
    where no superstructure was calibrated."""
    is_at_rest: bool
    """True if the record begins and ends at rest; else the modes' free vibration at its ends was estimated too."""
    prior_share: float
    """Share of the prior in the knowledge of the storeys' stiffness: 0 if all is from the record, 1 if all is prior."""
    fallback: str | None = None
    """Reason why the force is another estimator's; None if it is its own."""


def assessment_findings(assessment: Assessment | None, direction: Direction) -> tuple[Finding, ...]:
    """Findings about an estimate in one direction; none where its assumptions hold."""
    if assessment is None:
        return ()
    if assessment.fallback is not None:
        message = (
            f"direction {direction}: the calibrated superstructure was not used: {assessment.fallback}; the force is "
            "the paper's, with static interpolation between measured floors. A sensor on another floor would help"
        )
        return (Finding("estimator", "warning", message, value=assessment.chi_square),)
    if assessment.chi_square is not None and assessment.chi_square > EXPLAINED:
        message = (
            f"direction {direction}: noise alone does not explain what the superstructure leaves of the record "
            f"(chi-square {assessment.chi_square:.3g}); assumed: {assessment.assumption}; measured floors stay as "
            "measured, and the force's standard deviation allows for it"
        )
        return (Finding("estimator", "note", message, value=assessment.chi_square),)
    return ()


@dataclass(frozen=True, slots=True, eq=False)
class StoreyStiffness:
    """Stiffness of every storey against its design, from the lowest storey up."""

    deviation: Vector
    """(floors,) logarithm of the stiffness over the design's."""
    covariance: Matrix
    """(floors, floors) of the deviation, posterior."""
    prior_covariance: Matrix
    """(floors, floors) of the deviation before the record; the prior's mean is the design, up to an unknown scale."""
    with_given_masses: "StoreyStiffness | None" = None
    """By the floor masses as given, where this is by corrected ones."""
    evidence_of_masses: float = 0.0
    """Log evidence of the masses as given over corrected ones, by this record."""

    @property
    def information(self) -> Matrix:
        """(floors, floors) information of the record alone, an inverse covariance; 0 where it determines nothing."""
        scale = np.sqrt(np.diag(self.covariance))
        gained = np.linalg.inv(self.covariance) - np.linalg.inv(self.prior_covariance)
        values, vectors = np.linalg.eigh(gained * np.outer(scale, scale))
        return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T / np.outer(scale, scale))

    @property
    def pull(self) -> Vector:
        """(floors,) information times the deviation by the record alone."""
        return np.asarray(np.linalg.solve(self.covariance, self.deviation))


@dataclass(frozen=True, slots=True, eq=False)
class RestoringForce:
    """The isolation layer's restoring force; positive where the layer is displaced to the positive side."""

    estimator: str
    force: Vector
    """(n,) N, eq 10: rigid + modal."""
    rigid: Vector
    """(n,) N, inertia of the whole building moving as the base slab."""
    modal: Vector
    """(n,) N, inertia of the superstructure's motion relative to the base slab."""
    std: Vector
    """(n,) N, standard deviation, with what the superstructure's model may have wrong."""
    modes: tuple[Mode, ...]
    error: ErrorSpectrum | None = None
    """Spectrum of the error behind `noise_std`, N²/Hz; None of an estimator that does not provide it."""
    assessment: Assessment | None = None
    """None of an estimator that does not assess itself."""
    superstructure: FixedBaseModes | None = None
    """All modes of the superstructure calibrated from the record; None where none was, or interpolation errs less."""
    storeys: StoreyStiffness | None = None
    """Storeys of the same superstructure against their design; None without one, or without a design stiffness."""

    noise_std: Vector | None = None
    """(n,) N, standard deviation by the sensors' noise and by motion and parameters that the record leaves open. Models
    are fitted and compared by it: the rest of `std` is no noise but is alike from sample to sample. It can exceed
    `std` where left-out floors show less unmodelled motion than the calibration allows for. None: `std`."""
    systematic: Matrix | None = None
    """(p, n) N, effect of one standard deviation of each of p independent errors that are alike from sample to sample.
    They are part of `std`, and of the deviations of k_eq and c_eq. None of an estimator that does not provide them."""

    @property
    def fitting_std(self) -> Vector:
        """(n,) N, standard deviation by which models are fitted."""
        return self.std if self.noise_std is None else self.noise_std

    @property
    def peak(self) -> tuple[float, float]:
        """N, largest absolute force, and its standard deviation."""
        at = int(np.argmax(np.abs(self.force)))
        return float(abs(self.force[at])), float(self.std[at])
