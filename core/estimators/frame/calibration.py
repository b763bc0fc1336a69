"""Which superstructure explains a record, and how well?"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from core.arrays import Matrix, Vector
from core.estimators.frame.evaluation import Evaluation, Question, Slope, evaluated, slope
from core.estimators.frame.prior import Hypothesis
from core.estimators.frame.superstructure_model import Superstructure
from core.estimators.frame.unmodelled_motion import Variances
from core.estimators.frame.variance_step import improved

STEPS = 60
"""Of Levenberg and Marquardt, at most."""
ENOUGH = 700
"""Lines that are enough to come near."""
SETTLED = 0.2
"""Fall of the cost, in units of a log likelihood times the chi-square, below which a calibration has settled."""
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
    lines: int
    """Number of those that it was found by."""
    noise: Vector
    """(channels,) mean square of the noise's transform that it was judged by."""
    has_settled: bool

    @property
    def chi_square(self) -> float:
        """Misfit per degree of freedom: 1 where noise explains all that the model leaves."""
        return float(self.misfit_by_band.sum()) / self.degrees_of_freedom


def calibrated(question: Question, start: Vector) -> Calibration:
    """The parameters of greatest posterior probability, by Levenberg and Marquardt's method.

    Variances are estimated in the same steps. Most of the way is gone on a part of the lines.

    Args:
        question: what is to be found.
        start: (size,) parameters.
    """
    found = on_some_lines(question, start)
    return found if found.lines == question.lines.angular.size else on_all_lines(question, found)


def on_some_lines(question: Question, start: Vector) -> Calibration:
    """The same by ENOUGH evenly spread lines or somewhat more; by all where there are less than twice as many."""
    lines = question.lines
    few = replace(question, lines=lines.every(max(1, lines.angular.size // ENOUGH)))
    return _settled(few, start, first_variances(few))


def on_all_lines(question: Question, near: Calibration) -> Calibration:
    """The same by all lines, from what some of them said."""
    return _settled(question, near.parameters, near.variances)


def _settled(question: Question, start: Vector, variances: Variances) -> Calibration:
    here = evaluated(question, start, variances)
    damping, has_settled = 1e-3, False
    for _ in range(STEPS):
        before = here.cost
        for _ in range(VARIANCE_STEPS if question.hypothesis.is_random else 0):
            here = evaluated(question, here.parameters, improved(here), here.given.base)
        way = slope(here)
        there, damping = _step(here, way, damping)
        has_settled = there is None or before - there.cost < SETTLED * max(1.0, here.chi_square)
        here = there or here
        if has_settled:
            break
    return _result(here, has_settled)


def first_variances(question: Question) -> Variances:
    """Where the search for the variances begins."""
    return (Variances.first if question.hypothesis.is_random else Variances.none)(question.lines)


def best_start(question: Question) -> Vector:
    """The prior's parameters at the first frequency that explains the record best."""
    lines, layout = question.lines, question.design.layout
    coarse = replace(question, lines=lines.every(max(1, lines.angular.size // 600)))
    variances = first_variances(coarse)
    starts = []
    for frequency in STARTS:
        start = question.hypothesis.mean.copy()
        start[layout.scale] = 2 * np.log(frequency)
        starts.append((evaluated(coarse, start, variances).cost, start))
    return min(starts, key=lambda pair: pair[0])[1]


def _step(here: Evaluation, way: Slope, damping: float) -> tuple[Evaluation | None, float]:
    """The evaluation at the next parameters, None if no step lowers the cost; and the damping for the next."""
    free = here.question.hypothesis.free
    normal, descent = way.normal[np.ix_(free, free)], way.descent[free]
    scale = 1 / np.sqrt(np.diag(normal))
    scaled = normal * np.outer(scale, scale)
    logarithms = free < here.question.design.layout.delays.start
    for _ in range(8):
        change = scale * linalg.solve(scaled + damping * np.eye(scale.size), scale * descent, assume_a="pos")
        longest = np.abs(change[logarithms]).max(initial=0.0)
        tried = here.parameters.copy()
        tried[free] += change * min(1.0, LARGEST_STEP / max(longest, 1e-300))
        there = evaluated(here.question, tried, here.variances, here.given.base)
        # the determinant is compared at the same h
        if there.cost < here.cost:
            return there, max(damping / 5, 1e-7)
        damping *= 8
    return None, damping


def _result(here: Evaluation, has_settled: bool) -> Calibration:
    free, lines = here.question.hypothesis.free, here.question.lines
    information = slope(here).normal
    normal = information[np.ix_(free, free)]
    covariance = np.zeros_like(information)
    scale = 1 / np.sqrt(np.diag(normal))
    values, directions = linalg.eigh(normal * np.outer(scale, scale))
    # where hardly anything is known, rounding would make a variance negative
    spread = scale[:, None] * directions / np.sqrt(np.maximum(values, np.finfo(float).eps))
    covariance[np.ix_(free, free)] = spread @ spread.T
    return Calibration(
        hypothesis=here.question.hypothesis,
        parameters=here.parameters,
        structure=here.structure,
        variances=here.variances,
        covariance=covariance,
        misfit_by_band=here.misfit_by_band,
        degrees_of_freedom=here.degrees_of_freedom,
        lines=lines.angular.size,
        noise=lines.noise,
        has_settled=has_settled,
    )


def log_evidence(calibration: Calibration, question: Question) -> float:
    """Laplace's approximation of the log probability of the record under the calibration's hypothesis.

    Up to a constant of the lines; every estimated variance costs half the logarithm of the lines it is judged by
    (Schwarz 1978).

    Args:
        calibration: from the same lines, perhaps with another noise.
        question: the lines, and the building.
    """
    hypothesis = calibration.hypothesis
    # all determinants are counted, whatever the hypothesis
    open_to_noise = replace(question, hypothesis=replace(hypothesis, is_random=True))
    cost = evaluated(open_to_noise, calibration.parameters, calibration.variances).cost
    free = hypothesis.free
    occam = float(np.sum(np.log(hypothesis.std[free])))
    occam -= 0.5 * float(np.linalg.slogdet(calibration.covariance[np.ix_(free, free)])[1])
    if hypothesis.is_random:
        count = np.bincount(question.lines.band)
        occam += float(np.sum(np.log(count[count > 0])))
    return -cost - occam
