from collections.abc import Callable

import numpy as np
import pytest
from exact_lines import DESIGN, foreign

from core.arrays import Vector
from core.estimators.frame.calibration import first_variances
from core.estimators.frame.evaluation import Question, evaluated, slope
from core.estimators.frame.hypotheses import as_told, corrected, with_modal_damping, with_unmodelled_motion
from core.estimators.frame.prior import Hypothesis
from core.estimators.frame.superstructure_model import Design

LAYOUT = DESIGN.layout
AMPLITUDE = 3.0
"""m/s² kg^½, of free vibrations."""
STEP = 1e-5
"""Of central differences."""

Making = Callable[[Design, float], Hypothesis]


def moved(hypothesis: Hypothesis, rng: np.random.Generator) -> Vector:
    """(size,) its mean, all that is free moved by some of its deviation; a first frequency of 1.2 Hz."""
    found = hypothesis.mean + 0.1 * np.minimum(hypothesis.std, 3.0) * rng.standard_normal(hypothesis.mean.size)
    found[LAYOUT.scale] = 2 * np.log(1.2)
    return np.asarray(found)


def damped_by_mode(design: Design, transient: float) -> Hypothesis:
    return with_modal_damping(with_unmodelled_motion(design, transient), design.layout)


def corrected_and_damped(design: Design, transient: float) -> Hypothesis:
    return with_modal_damping(corrected(design, transient), design.layout)


@pytest.mark.parametrize("at_rest", [True, False])
@pytest.mark.parametrize("making", [as_told, corrected, with_unmodelled_motion, damped_by_mode, corrected_and_damped])
def test_descent_is_the_costs(making: Making, at_rest: bool) -> None:
    """Every free parameter, against central differences: right to 1e-5 by rounding."""
    rng = np.random.default_rng(1)
    hypothesis = making(DESIGN, 0.0 if at_rest else AMPLITUDE)
    question = Question(foreign(rng, at_rest=at_rest), DESIGN, hypothesis)
    at, variances = moved(hypothesis, rng), first_variances(question)
    here = evaluated(question, at, variances)
    found = slope(here).descent
    differences = np.zeros(LAYOUT.size)
    for place in hypothesis.free:
        move = STEP * (np.arange(LAYOUT.size) == place)
        ahead, behind = (evaluated(question, at + way * move, variances, here.given.base).cost for way in (1, -1))
        differences[place] = (behind - ahead) / (2 * STEP)
    free = hypothesis.free
    tolerance = 1e-6 * np.abs(differences).max()
    assert found[free] == pytest.approx(differences[free], rel=1e-5, abs=tolerance)
    assert np.abs(differences[free]).min() > tolerance  # none that both hold for nothing
