"""Calibration of the frame from a record: the parameters of greatest posterior probability, and their evidence."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from core.arrays import ComplexMatrix, Matrix, Vector
from core.estimators.frame.evaluation import Evaluation, Hypothesis, Problem, evaluated, with_variances
from core.estimators.frame.gradient import gradient
from core.estimators.frame.likelihood import DYNAMIC_SHARE, Variances, local_covariance
from core.estimators.frame.lines import Lines
from core.estimators.frame.model import Superstructure
from core.optimisation import Damping, FactorDamping, Quadratic, Step, lower_point, minimised
from core.signals.spectra import squared

STEPS = 60
"""Largest number of Levenberg-Marquardt steps. A choice."""
FIRST_DAMPING = FactorDamping(value=1e-3, divisor=5.0, multiplier=8.0, smallest=1e-7)
"""Damping of the first step, relative to the diagonal, and its changes. Not tuned."""
MOST_TRIALS = 8
"""Trials of larger damping in one step; the last damping is 2 million times the first. A choice."""
ENOUGH = 700
"""Lines by which a first, coarse calibration is made. A choice."""
SETTLED = 0.2
"""Fall of the cost, in units of a log likelihood times the chi-square, below which a calibration has settled. A
choice."""
STARTS = np.geomspace(0.4, 8.0, 24)
"""Hz, first fixed-base frequencies tried as a start. A choice."""
VARIANCE_STEPS = 2
"""Steps of the variances before each step of the parameters. A choice."""
LARGEST_STEP = 1.0
"""Largest step of a parameter that is a logarithm. A choice."""


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A superstructure calibrated from a record."""

    hypothesis: Hypothesis
    parameters: Vector
    structure: Superstructure
    variances: Variances
    covariance: Matrix
    """(size, size) of the parameters; 0 for those that are fixed."""
    misfit_by_band: Vector
    """(bands,) Σ zᴴ P z over their lines; its mean is the number of lines times floors if the hypothesis holds."""
    degrees_of_freedom: float
    lines: int
    """Number of spectral lines used."""
    noise: Vector
    """(channels,) mean square of the noise's transform that was assumed."""
    has_settled: bool

    @property
    def chi_square(self) -> float:
        """Misfit per degree of freedom: 1 where noise explains all that the model leaves."""
        return float(self.misfit_by_band.sum()) / self.degrees_of_freedom


def calibrated(problem: Problem, start: Vector) -> Calibration:
    """The parameters of greatest posterior probability, by Levenberg and Marquardt's method.

    Variances are estimated in the same steps. A subset of the lines gives the start for all.

    Args:
        problem: lines, design and hypothesis.
        start: (size,) parameters.
    """
    here, has_settled = _best_by_some_lines(problem, start)
    if here.problem.lines.angular.size == problem.lines.angular.size:
        return _result(here, has_settled)
    return _result(*_settled(problem, here.parameters, here.variances))


def best_by_some_lines(problem: Problem, start: Vector) -> Vector:
    """(size,) parameters of greatest posterior probability by as many lines as `on_some_lines` uses."""
    return _best_by_some_lines(problem, start)[0].parameters


def on_some_lines(problem: Problem, start: Vector) -> Calibration:
    """Calibration by about ENOUGH evenly spread lines; by all where there are less than twice as many."""
    return _result(*_best_by_some_lines(problem, start))


def _best_by_some_lines(problem: Problem, start: Vector) -> tuple[Evaluation, bool]:
    few = replace(problem, lines=some_lines(problem.lines))
    return _settled(few, start, first_variances(few))


def some_lines(lines: Lines) -> Lines:
    """About ENOUGH of the lines, evenly spread; all where there are less than twice as many."""
    return lines.every(max(1, lines.angular.size // ENOUGH))


def on_all_lines(problem: Problem, near: Calibration) -> Calibration:
    """Calibration by all lines, started from that by some."""
    if near.lines == problem.lines.angular.size:
        return near
    return _result(*_settled(problem, near.parameters, near.variances))


def _settled(problem: Problem, start: Vector, variances: Variances) -> tuple[Evaluation, bool]:
    """The evaluation at which a calibration ends, and whether it has settled."""
    first = evaluated(problem, start, variances)
    return minimised(first, _step, _has_settled, FIRST_DAMPING, STEPS)


def _step(here: Evaluation, damping: Damping) -> Step[Evaluation] | None:
    """Steps of the variances, then one of the parameters."""
    for _ in range(VARIANCE_STEPS if here.problem.hypothesis.is_random else 0):
        here = with_variances(here, next_variances(here), here.given.base)
    free, slope = here.problem.hypothesis.free, gradient(here)
    normal = slope.normal[np.ix_(free, free)]
    unit = 1 / np.sqrt(np.diag(normal))
    # in units of each parameter's own deviation: data determine some flexibilities so little that rounding shows
    quadratic = Quadratic(normal * np.outer(unit, unit), unit * slope.descent[free], np.ones(unit.size))
    return lower_point(here, quadratic, lambda step: _moved(here, unit * step), damping, MOST_TRIALS)


def _moved(here: Evaluation, step: Vector) -> Evaluation:
    """Evaluation after a step of the free parameters, shortened to LARGEST_STEP; its determinant is at the same h."""
    free = here.problem.hypothesis.free
    longest = np.abs(step[free < here.problem.design.layout.delays.start]).max(initial=0.0)
    parameters = here.parameters.copy()
    parameters[free] += step * min(1.0, LARGEST_STEP / max(longest, 1e-300))
    return evaluated(here.problem, parameters, here.variances, here.given.base)


def _has_settled(before: Evaluation, latest: Step[Evaluation]) -> bool:
    """True if no trial lowered the cost, or the variances and the parameters together lowered it by little."""
    enough = SETTLED * max(1.0, latest.start.chi_square)
    return latest.gained == 0 or before.cost - latest.point.cost < enough


def expected(problem: Problem, parameters: Vector, variances: Variances) -> Calibration:
    """Calibration at given parameters and variances, without a step."""
    return _result(evaluated(problem, parameters, variances), has_settled=True)


def first_variances(problem: Problem) -> Variances:
    """Variances at which their search starts."""
    return (Variances.first if problem.hypothesis.is_random else Variances.none)(problem.lines)


def best_start(problem: Problem) -> Vector:
    """The prior's parameters at the first frequency that explains the record best."""
    lines, layout = problem.lines, problem.design.layout
    coarse = replace(problem, lines=lines.every(max(1, lines.angular.size // 600)))
    variances = first_variances(coarse)
    starts = []
    for frequency in STARTS:
        start = problem.hypothesis.mean.copy()
        start[layout.scale] = 2 * np.log(frequency)
        starts.append((evaluated(coarse, start, variances).cost, start))
    return min(starts, key=lambda pair: pair[0])[1]


def _result(here: Evaluation, has_settled: bool) -> Calibration:
    free, lines = here.problem.hypothesis.free, here.problem.lines
    information = gradient(here).normal
    normal = information[np.ix_(free, free)]
    covariance = np.zeros_like(information)
    scale = 1 / np.sqrt(np.diag(normal))
    values, directions = linalg.eigh(normal * np.outer(scale, scale))
    # where almost nothing is known, rounding would make a variance negative
    spread = scale[:, None] * directions / np.sqrt(np.maximum(values, np.finfo(float).eps))
    covariance[np.ix_(free, free)] = spread @ spread.T
    return Calibration(
        hypothesis=here.problem.hypothesis,
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


def log_evidence(calibration: Calibration, problem: Problem, along: ComplexMatrix) -> float:
    """Laplace's approximation of the log probability of the record under the calibration's hypothesis.

    Up to a constant of the lines; every estimated variance costs half the logarithm of the lines it is judged by
    (Schwarz 1978). The base slab's amplitude is free at every line. Integrated out, it leaves a determinant along h,
    which for all hypotheses is taken at the same h: along that of each, it differed by a hundred and more where noise
    is strong, by modes that no sensor shows.

    Args:
        calibration: from the same lines, perhaps with another noise.
        problem: lines and building.
        along: (channels, lines) the h at which the determinant is taken, the same for all that are compared.
    """
    hypothesis = calibration.hypothesis
    here = evaluated(replace(problem, hypothesis=hypothesis), calibration.parameters, calibration.variances, along)
    # the determinant of the noise alone is a constant
    cost = here.cost if hypothesis.is_random else here.cost + float(np.log(squared(along).sum(axis=0)).sum())
    free = hypothesis.free
    occam = float(np.sum(np.log(hypothesis.std[free])))
    occam -= 0.5 * float(np.linalg.slogdet(calibration.covariance[np.ix_(free, free)])[1])
    if hypothesis.is_random:
        count = np.bincount(problem.lines.band)
        occam += float(np.sum(np.log(count[count > 0])))
    return -cost - occam


def promised(calibration: Calibration, problem: Problem) -> float:
    """Decrease of the cost that a hypothesis with more free parameters promises, to second order (Rao 1948).

    Args:
        calibration: by a hypothesis that is a special case of it.
        problem: lines, building and the wider hypothesis.
    """
    free, slope = problem.hypothesis.free, gradient(evaluated(problem, calibration.parameters, calibration.variances))
    normal = slope.normal[np.ix_(free, free)]
    unit = 1 / np.sqrt(np.diag(normal))
    descent = unit * slope.descent[free]
    return 0.5 * float(descent @ linalg.lstsq(normal * np.outer(unit, unit), descent)[0])


def next_variances(here: Evaluation) -> Variances:
    """The next variances by restricted maximum likelihood: the factors of Zhou, Hu, Qiao, Cho and Zhou (2019).

    Args:
        here: the evaluation by a hypothesis that allows for unmodelled motion.
    """
    met, size = _strengths(here)
    lines, count = here.problem.lines, here.variances.rocking.size
    met, size = (np.array([np.bincount(lines.band, row, count) for row in each]) for each in (met, size))
    rocking, floors = np.sqrt(met / np.maximum(size, 1e-300))
    return Variances(here.variances.rocking * rocking, here.variances.floors * floors)


def _strengths(here: Evaluation) -> tuple[Matrix, Matrix]:
    """(2, lines) |Bᴴ P z|² and trace Bᴴ P B: of the rocking, and of the floors' own motion."""
    lines = here.problem.lines
    noise = lines.noise[1:]
    local = local_covariance(here.problem.design)[1:, 1:] / np.sqrt(np.outer(noise, noise))
    factor = np.linalg.cholesky(local)
    alone = np.zeros((len(factor), len(factor) + 1, here.residual.shape[1]), dtype=complex)
    alone[:, 1:] = factor.T[:, :, None] / np.sqrt(lines.colour)
    alone = here.whitened.of(alone)
    share, through = DYNAMIC_SHARE, here.unmodelled
    met, met_alone = (squared(np.einsum("icl,cl->il", each.conj(), here.residual)) for each in (through, alone))
    size, size_alone = (np.sum(squared(each), axis=1) for each in (through, alone))
    return (
        np.array([met[0], share * met[1:].sum(axis=0) + (1 - share) * met_alone.sum(axis=0)]),
        np.array([size[0], share * size[1:].sum(axis=0) + (1 - share) * size_alone.sum(axis=0)]),
    )
