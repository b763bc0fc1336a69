"""Masses of the building file that do not fit are the outcome, unless an effect is missing besides."""

from collections.abc import Mapping
from functools import cache

import pytest
from building_models import paper
from floor_motion import with_floor_damper, with_floors
from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.building_faults import FLOOR_SHARE
from core.model.isolator import Isolator
from core.workbench.diagnosing import diagnose
from core.workbench.diagnosis_result import DiagnosisResult

PEAKS = (0.01, 0.08, 0.03, 0.05)
OFFERED = ("hardening", "inerter", "asymmetry", "resonator")
HIDDEN: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    "none": {},
    "hardening": {"hardening": {"k3": 1e10, "k5": 0.0}},
    "oscillator": {"resonator": {"mass": 4e5, "frequency": 1.7, "damping": 0.03}},
}


@cache
def diagnosed(change: float, hidden: str) -> DiagnosisResult:
    truth = Isolator({**BOUC_WEN.effects, **HIDDEN[hidden]})
    seen = [with_floors(one, change, paper()) for one in observations(truth, 0.01, 3, PEAKS)]
    return diagnose(BOUC_WEN, seen, hold_out=[seen[-1].name], effects=OFFERED)


@pytest.mark.accuracy
@pytest.mark.parametrize("change", [-0.08, 0.1])
def test_wrong_masses_are_the_outcome_and_the_first_sentence(change: float) -> None:
    result = diagnosed(change, "none")
    assert result.outcome == "mass"
    assert [one.kind for one in result.faults] == [FLOOR_SHARE]
    assert result.diagnosis.named == ()
    first, second, *_ = result.text
    assert first.startswith("The masses in the building file do not fit: the floors have ")
    assert "of the excess error where the model was fitted and " in first
    assert first.endswith(
        "Check the masses in the building file, correct them if they are wrong, and run the analysis again."
    )
    assert second == (
        "The findings on the isolation layer below come from forces for the masses of the records. Correct the "
        "building file before you fit a model."
    )


def test_beside_wrong_masses_a_hidden_effect_is_named_and_both_are_stated() -> None:
    result = diagnosed(-0.08, "hardening")
    assert result.outcome == "effect"
    assert [step.chosen.effect for step in result.diagnosis.named] == ["hardening"]
    (fault,) = result.faults
    assert (fault.kind, fault.is_corrected) == (FLOOR_SHARE, True)
    assert result.text[0].startswith("The masses in the building file do not fit")
    assert any("(hardening) is missing" in sentence for sentence in result.text)


@pytest.mark.parametrize(
    ("hidden", "named"), [("none", []), ("hardening", ["hardening"]), ("oscillator", ["resonator"])]
)
def test_masses_that_fit_are_not_mentioned(hidden: str, named: list[str]) -> None:
    result = diagnosed(0.0, hidden)
    assert result.faults == ()
    assert [step.chosen.effect for step in result.diagnosis.named] == named
    assert not any("masses in the building file" in sentence for sentence in result.text)


def test_a_damper_on_a_floor_is_no_wrong_mass() -> None:
    """Beside a mass on the slab, which comes near, a wrong share would take a part of what is left."""
    seen = [with_floor_damper(with_floors(one, 0.0, paper())) for one in observations(BOUC_WEN, 0.01, 3, PEAKS)]
    result = diagnose(BOUC_WEN, seen, hold_out=[seen[-1].name], effects=(*OFFERED, "tuned_mass"))
    assert result.faults == ()
    assert [step.chosen.effect for step in result.diagnosis.steps] == ["tuned_mass"]
    assert not any("masses in the building file" in sentence for sentence in result.text)
