"""A diagnosis says when an effect replaces one of the model's own."""

import pytest
from records_from_observations import records_from_observations
from synthetic_observations import BOUC_WEN, observations

from core.model.isolator import Isolator
from core.workbench.diagnosing import diagnose
from core.workbench.diagnosis_result import DiagnosisResult

STEEL = {"F_m": 2e6, "D_m": 4e-3, "R_0": 15.0}
SENTENCE = (
    "With Steel in parallel, rounder after it has yielded (steel_hysteresis), nothing is left of Bouc-Wen hysteresis "
    "(bouc_wen), which is replaced"
)


def by_steel(*, alone: bool) -> DiagnosisResult:
    """A model whose damper is round, by records of a layer whose damper is of steel, or that has both."""
    kept = {name: values for name, values in BOUC_WEN.effects.items() if name != "bouc_wen" or not alone}
    truth = Isolator({**kept, "steel_hysteresis": STEEL if alone else {**STEEL, "D_m": 2e-2}})
    seen = records_from_observations(list(observations(truth, 0.02, 5, (0.005, 0.03, 0.08))))
    return diagnose(BOUC_WEN, seen, effects=("sharp_hysteresis", "steel_hysteresis", "friction"), directions=["x"])


@pytest.mark.accuracy
@pytest.mark.parametrize("alone", [True, False])
def test_a_steel_damper_is_named_and_replaces_the_round_one_where_it_is_alone(*, alone: bool) -> None:
    found = by_steel(alone=alone)
    assert [[one.effect for one in stage.step.alike] for stage in found.stages] == [["steel_hysteresis"]]
    values = found.model.effects["steel_hysteresis"]
    assert (values["F_m"], values["D_m"]) == pytest.approx((2e6, 4e-3 if alone else 2e-2), rel=0.05)
    assert (SENTENCE in " ".join(found.text)) == alone
