import numpy as np
import pytest
from exact_lines import DESIGN, PAPER, exact, noisy, rocked

from core.estimators.frame.calibration import first_variances
from core.estimators.frame.evaluation import Question, evaluated
from core.estimators.frame.hypotheses import as_told, with_unmodelled_motion
from core.estimators.frame.superstructure_model import Design
from core.estimators.frame.unmodelled_motion import Variances, local_covariance, static_flexibility
from core.estimators.frame.variance_step import improved
from core.paper import BUILDING


def test_static_flexibility_is_that_of_springs_in_series() -> None:
    """As a force on one floor moves the others; 1 at the roof."""
    design = Design.of(BUILDING.floor_mass, BUILDING.storey_stiffness, np.array([2, 6]))
    found, single = static_flexibility(design), 1 / BUILDING.storey_stiffness
    assert found[-1] == pytest.approx(np.cumsum(single) / single.sum())
    assert found[1, 4] == pytest.approx(single[:2].sum() / single.sum())
    assert local_covariance(design)[1:, 1:] == pytest.approx(found[np.ix_([2, 6], [2, 6])])
    assert not local_covariance(design)[0].any()


def test_nothing_is_unmodelled_of_a_superstructure_that_explains_all() -> None:
    rng = np.random.default_rng(1)
    question = Question(noisy(exact(PAPER, rng), 0.01, rng), DESIGN, as_told(DESIGN, 0.0))
    assert not first_variances(question).at(question.lines).any()


def test_every_step_lowers_the_cost() -> None:
    """A step is that of a majorant at the same h: it cannot raise the cost."""
    rng = np.random.default_rng(2)
    lines = noisy(rocked(exact(PAPER, rng), PAPER, 0.3, rng), 0.01, rng)
    question = Question(lines, DESIGN, with_unmodelled_motion(DESIGN, 0.0))
    here = evaluated(question, question.hypothesis.mean, Variances.first(lines))
    along = here.given.base
    for _ in range(10):
        there = evaluated(question, here.parameters, improved(here), along)
        assert there.cost < here.cost + 1e-9 * abs(here.cost)
        here = there
