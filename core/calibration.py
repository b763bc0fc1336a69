"""Which superstructure explains a record, and how well?"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.evaluation import Evaluation, Hypothesis, Variances, evaluated
from core.spectral_lines import Lines
from core.superstructure_model import Design, Superstructure

STEPS = 60
"""Of Levenberg and Marquardt, at most."""
ENOUGH = 700
"""Lines that are enough to come near."""
SETTLED = 0.2
"""Fall of the cost, in units of a log likelihood, below which a calibration has settled."""
STARTS = np.geomspace(0.4, 8.0, 24)
"""Hz, first fixed-base frequencies that a calibration may start from."""
VARIANCE_STEPS = 2
"""Of the variances, before each of the parameters."""
LARGEST_STEP = 1.0
"""Of any parameter that is a logarithm."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A superstructure as calibrated from a record."""

    hypothesis: Hypothesis
    parameters: Vector
    structure: Superstructure
    variances: Variances
    covariance: Matrix
    """(size, size) of the parameters; 0 for those held."""
    misfit_by_band: Vector
    """(bands,) Σ zᴴ P z over their lines; its mean is the number of lines times floors if the hypothesis holds."""
    degrees_of_freedom: float
    noise: Vector
    """(channels,) mean square of the noise's transform that it was judged by."""
    has_settled: bool

    @property
    def chi_square(self) -> float:
        """Misfit per degree of freedom: 1 where noise explains all that the model leaves."""
        return float(self.misfit_by_band.sum()) / self.degrees_of_freedom


def calibrated(lines: Lines, design: Design, hypothesis: Hypothesis, start: Vector) -> Calibration:
    """The parameters of greatest posterior probability, by Levenberg and Marquardt's method.

    Variances are estimated in the same steps by restricted maximum likelihood (the multiplicative step of Zhou, Hu,
    Qiao, Cho and Zhou 2019).

    Args:
        lines: of the record.
        design: what is believed of the building.
        hypothesis: what is free.
        start: (size,) parameters.
    """
    if lines.angular.size > 2 * ENOUGH:
        # most of the way is gone on a part of the lines
        start = calibrated(lines.every(lines.angular.size // ENOUGH), design, hypothesis, start).parameters
    variances = first_variances(lines, hypothesis)
    found, state = start, evaluated(lines, design, hypothesis, start, variances, None)
    damping, has_settled = 1e-3, False
    for _ in range(STEPS):
        before = state.cost
        for left in reversed(range(VARIANCE_STEPS if hypothesis.is_random else 0)):
            variances = _improved(variances, state.steps)
            state = evaluated(lines, design, hypothesis, found, variances, state.frozen, is_derived=left == 0)
        tried, trial, damping = _step(lines, design, hypothesis, found, variances, state, damping)
        if trial is None:
            has_settled = True
            break
        has_settled = before - trial.cost < SETTLED
        found, state = tried, trial
        if has_settled:
            break
    return _result(lines, hypothesis, found, variances, state, has_settled)


def first_variances(lines: Lines, hypothesis: Hypothesis) -> Variances:
    """A hundredth of the record's power in each band; none where nothing is random."""
    count = np.bincount(lines.band)
    power = np.bincount(lines.band, np.mean(np.abs(lines.spectra) ** 2, axis=0)) / np.maximum(count, 1)
    share = 0.01 if hypothesis.is_random else 0.0
    return Variances(share * power, share * power)


def best_start(lines: Lines, design: Design, hypothesis: Hypothesis) -> Vector:
    """The prior's parameters at the first frequency that explains the record best."""
    coarse = lines.every(max(1, lines.angular.size // 600))
    variances = first_variances(coarse, hypothesis)
    starts = []
    for frequency in STARTS:
        start = hypothesis.mean.copy()
        start[design.layout.scale] = 2 * np.log(frequency)
        cost = evaluated(coarse, design, hypothesis, start, variances, None, is_derived=False).cost
        starts.append((cost, start))
    return min(starts, key=lambda pair: pair[0])[1]


def _step(
    lines: Lines,
    design: Design,
    hypothesis: Hypothesis,
    found: Vector,
    variances: Variances,
    state: Evaluation,
    damping: float,
) -> tuple[Vector, Evaluation | None, float]:
    """The next parameters with their evaluation, None if no step lowers the cost; and the damping for the next."""
    free = hypothesis.free
    normal, descent = state.normal[np.ix_(free, free)], state.descent[free]
    scale = 1 / np.sqrt(np.diag(normal))
    scaled = normal * np.outer(scale, scale)
    logarithms = free < design.layout.delays.start
    for _ in range(8):
        change = scale * linalg.solve(scaled + damping * np.eye(scale.size), scale * descent, assume_a="pos")
        longest = np.abs(change[logarithms]).max(initial=0.0)
        tried = found.copy()
        tried[free] += change * min(1.0, LARGEST_STEP / max(longest, 1e-300))
        trial = evaluated(lines, design, hypothesis, tried, variances, state.frozen)
        # the determinant is compared at the same h
        if trial.cost < state.cost:
            return tried, trial, max(damping / 5, 1e-7)
        damping *= 8
    return found, None, damping


def _improved(variances: Variances, steps: Matrix) -> Variances:
    ratio = np.sqrt(steps[:, [0, 2]] / np.maximum(steps[:, [1, 3]], 1e-300))
    return Variances(variances.rocking * ratio[:, 0], variances.floors * ratio[:, 1])


def _result(
    lines: Lines,
    hypothesis: Hypothesis,
    found: Vector,
    variances: Variances,
    state: Evaluation,
    has_settled: bool,
) -> Calibration:
    free = hypothesis.free
    normal = state.normal[np.ix_(free, free)]
    covariance = np.zeros_like(state.normal)
    scale = 1 / np.sqrt(np.diag(normal))
    values, directions = linalg.eigh(normal * np.outer(scale, scale))
    # where hardly anything is known, rounding would make a variance negative
    spread = scale[:, None] * directions / np.sqrt(np.maximum(values, np.finfo(float).eps))
    covariance[np.ix_(free, free)] = spread @ spread.T
    return Calibration(
        hypothesis=hypothesis,
        parameters=found,
        structure=state.structure,
        variances=variances,
        covariance=covariance,
        misfit_by_band=state.steps[:, 4],
        degrees_of_freedom=float(lines.angular.size * (lines.spectra.shape[0] - 1)),
        noise=lines.noise,
        has_settled=has_settled,
    )


def log_evidence(calibration: Calibration, lines: Lines, design: Design) -> float:
    """Laplace's approximation of the log probability of the record under the calibration's hypothesis.

    Up to a constant of the lines; every estimated variance costs half the logarithm of the lines it is judged by
    (Schwarz 1978).

    Args:
        calibration: from these lines, perhaps with another noise.
        lines: of the record.
        design: of the building.
    """
    hypothesis, found, variances = calibration.hypothesis, calibration.parameters, calibration.variances
    open_to_noise = replace(hypothesis, is_random=True)
    here = evaluated(lines, design, open_to_noise, found, variances, None, is_derived=False).frozen
    cost = evaluated(lines, design, open_to_noise, found, variances, here, is_derived=False).cost
    free = hypothesis.free
    occam = float(np.sum(np.log(hypothesis.std[free])))
    occam -= 0.5 * float(np.linalg.slogdet(calibration.covariance[np.ix_(free, free)])[1])
    if hypothesis.is_random:
        count = np.bincount(lines.band)
        occam += float(np.sum(np.log(count[count > 0])))
    return -cost - occam
