"""The text of a diagnosis: what it says of the effects that it added."""

import pytest
from records_from_observations import records_from_observations
from synthetic_observations import BOUC_WEN, observations

from core.model.isolator import Isolator
from core.workbench.diagnosing import DiagnosisResult, diagnose

TEMPERATURES = {"temperature_strength": {"strengthening": 0.01}, "temperature_stiffness": {"stiffening": 0.006}}


@pytest.fixture(scope="module")
def by_two() -> DiagnosisResult:
    """Two effects are missing, and the first one alone has another value than beside the second."""
    truth = Isolator({**BOUC_WEN.effects, **TEMPERATURES})
    seen = records_from_observations(list(observations(truth, 0.01, 3, (0.02, 0.08, 0.03, 0.05))))
    return diagnose(BOUC_WEN, seen, effects=tuple(TEMPERATURES), directions=["x"])


def test_the_values_in_the_text_are_those_of_the_final_model(by_two: DiagnosisResult) -> None:
    first, _ = by_two.stages
    said, alone = (f"{model.effects[first.effect]['stiffening']:.4f}" for model in (by_two.model, first.fit.model))
    assert alone != said
    assert f"The rubber stiffens by a share of {said} for each degree" in by_two.text[0]
