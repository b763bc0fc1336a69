from collections.abc import Callable

import numpy as np
import pytest
from exact_spectra import DESIGN, PAPER, exact_lines, unrelated_lines, with_noise, with_rocking

from core.arrays import Vector
from core.estimators.frame.calibration import first_variances, next_variances
from core.estimators.frame.evaluation import Hypothesis, Problem, evaluated
from core.estimators.frame.gradient import gradient
from core.estimators.frame.hypotheses import as_given, corrected, with_modal_damping, with_unmodelled_motion
from core.estimators.frame.likelihood import Variances, local_covariance, static_flexibility
from core.estimators.frame.model import Design
from core.paper import BUILDING

LAYOUT = DESIGN.layout
AMPLITUDE = 3.0
"""m/s² kg^½, of free vibrations."""
STEP = 1e-5
"""Step of central differences."""

Making = Callable[[Design, float], Hypothesis]


def moved(hypothesis: Hypothesis, rng: np.random.Generator) -> Vector:
    """(size,) its mean, all that is free moved by some of its deviation; a first frequency of 1.2 Hz."""
    result = hypothesis.mean + 0.1 * np.minimum(hypothesis.std, 3.0) * rng.standard_normal(hypothesis.mean.size)
    result[LAYOUT.scale] = 2 * np.log(1.2)
    return np.asarray(result)


def damped_by_mode(design: Design, transient: float) -> Hypothesis:
    return with_modal_damping(with_unmodelled_motion(design, transient), design.layout)


def corrected_and_damped(design: Design, transient: float) -> Hypothesis:
    return with_modal_damping(corrected(design, transient), design.layout)


@pytest.mark.parametrize("at_rest", [True, False])
@pytest.mark.parametrize("making", [as_given, corrected, with_unmodelled_motion, damped_by_mode, corrected_and_damped])
def test_descent_is_the_costs(making: Making, at_rest: bool) -> None:
    """Every free parameter, against central differences: right to 1e-5 by rounding."""
    rng = np.random.default_rng(1)
    hypothesis = making(DESIGN, 0.0 if at_rest else AMPLITUDE)
    problem = Problem(unrelated_lines(rng, at_rest=at_rest), DESIGN, hypothesis)
    at, variances = moved(hypothesis, rng), first_variances(problem)
    here = evaluated(problem, at, variances)
    descent = gradient(here).descent
    differences = np.zeros(LAYOUT.size)
    for place in hypothesis.free:
        move = STEP * (np.arange(LAYOUT.size) == place)
        ahead, behind = (evaluated(problem, at + way * move, variances, here.given.base).cost for way in (1, -1))
        differences[place] = (behind - ahead) / (2 * STEP)
    free = hypothesis.free
    tolerance = 1e-6 * np.abs(differences).max()
    assert descent[free] == pytest.approx(differences[free], rel=1e-5, abs=tolerance)
    assert np.abs(differences[free]).min() > tolerance  # none that both hold for nothing


def test_static_flexibility_is_that_of_springs_in_series() -> None:
    """As a force on one floor moves the others; 1 at the roof."""
    design = Design.of(BUILDING.floor_mass, BUILDING.storey_stiffness, np.array([2, 6]))
    result, single = static_flexibility(design), 1 / BUILDING.storey_stiffness
    assert result[-1] == pytest.approx(np.cumsum(single) / single.sum())
    assert result[1, 4] == pytest.approx(single[:2].sum() / single.sum())
    assert local_covariance(design)[1:, 1:] == pytest.approx(result[np.ix_([2, 6], [2, 6])])
    assert not local_covariance(design)[0].any()


def test_nothing_is_unmodelled_of_a_superstructure_that_explains_all() -> None:
    rng = np.random.default_rng(1)
    problem = Problem(with_noise(exact_lines(PAPER, rng), 0.01, rng), DESIGN, as_given(DESIGN, 0.0))
    assert not first_variances(problem).at(problem.lines).any()


def test_every_step_lowers_the_cost() -> None:
    """A step is that of a majorant at the same h: it cannot raise the cost."""
    rng = np.random.default_rng(2)
    lines = with_noise(with_rocking(exact_lines(PAPER, rng), PAPER, 0.3, rng), 0.01, rng)
    problem = Problem(lines, DESIGN, with_unmodelled_motion(DESIGN, 0.0))
    here = evaluated(problem, problem.hypothesis.mean, Variances.first(lines))
    along = here.given.base
    for _ in range(10):
        there = evaluated(problem, here.parameters, next_variances(here), along)
        assert there.cost < here.cost + 1e-9 * abs(here.cost)
        here = there
