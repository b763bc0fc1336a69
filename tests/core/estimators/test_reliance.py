from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from core.estimators.frame.hypotheses import as_told, corrected, with_unmodelled_motion
from core.estimators.frame.prior import Hypothesis
from core.estimators.frame.superstructure_model import Design
from core.estimators.reliance import EXPLAINED, Reliance, reliance_findings
from core.paper import BUILDING

DESIGN = Design.of(BUILDING.floor_mass, None, np.array([2, 6]))
EXPLAINS = Reliance("masses and sensors as told", 1.05, is_at_rest=True, prior_share=0.1)


@pytest.mark.parametrize("making", [as_told, corrected, with_unmodelled_motion])
def test_what_was_assumed_is_said_once_in_a_whole_sentence(making: Callable[[Design, float], Hypothesis]) -> None:
    assumption = making(DESIGN, 0.0).name
    (found,) = reliance_findings(replace(EXPLAINS, assumption=assumption, chi_square=3.21), "x")
    words = found.message.split()
    assert (found.severity, found.value) == ("note", 3.21)
    assert f"(chi-square 3.21); assumed: {assumption}; measured floors stay as measured" in found.message
    assert all(one != other for one, other in pairwise(words))


def test_nothing_is_said_where_assumptions_hold_or_none_was_needed() -> None:
    for holds in (EXPLAINS, replace(EXPLAINS, chi_square=EXPLAINED), replace(EXPLAINS, chi_square=None)):
        assert reliance_findings(holds, "x") == ()
    assert reliance_findings(None, "x") == ()


def test_a_fallback_is_a_warning_that_says_why() -> None:
    (found,) = reliance_findings(replace(EXPLAINS, fallback="left-out floors are told badly"), "y")
    assert found.severity == "warning"
    assert found.message.startswith("direction y: the calibrated superstructure was not used: left-out floors are told")
