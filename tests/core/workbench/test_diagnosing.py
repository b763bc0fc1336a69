"""The text of a diagnosis: what it says of the effects that it added."""

import re
from dataclasses import replace

import numpy as np
import pytest
from records_from_observations import records_from_observations
from synthetic_observations import BOUC_WEN, observations

from core.model.isolator import Isolator
from core.workbench.candidates import stages
from core.workbench.diagnosing import diagnose
from core.workbench.diagnosis_result import DiagnosisResult
from core.workbench.texts import unseen

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


def test_an_effect_that_lowers_the_error_only_beside_another_is_added_after_it(by_two: DiagnosisResult) -> None:
    """Alone, the first effect would raise the error: here its value is three times too large."""
    diagnosis, refitted = by_two.diagnosis, by_two.versions[1]
    first, second = diagnosis.steps
    effect, fit = first.chosen.effect, first.chosen.fit
    values = fit.model.effects[effect]
    far = {**values, "stiffening": 3 * values["stiffening"]}
    poor = replace(fit, model=Isolator({**fit.model.effects, effect: far}))
    steps = (replace(first, chosen=replace(first.chosen, fit=poor)), second)
    staged, versions = stages(replace(diagnosis, steps=steps), refitted, by_two.earthquakes)
    assert [one.effect for one in staged] == [second.chosen.effect, effect]
    assert [one.name for one in versions[1:]] == [
        f"with {second.chosen.effect}",
        f"with {second.chosen.effect}, {effect}",
    ]
    errors = [one.error(by_two.earthquakes.fitted_names).rms for one in versions]
    assert errors == sorted(errors, reverse=True)


@pytest.fixture(scope="module")
def by_a_step() -> DiagnosisResult:
    """A loss between the second and the third earthquake, of layers whose temperature was not recorded."""
    truth = Isolator({**BOUC_WEN.effects, "stiffness_step": {"change": -0.2, "date": 45 * 86400.0, "width": 0.5}})
    seen = [
        replace(one, conditions=replace(one.conditions, temperature=np.full(one.layer.force.size, 20.0)))
        for one in observations(truth, 0.01, 3, (0.03, 0.05, 0.03, 0.05))
    ]
    return diagnose(BOUC_WEN, records_from_observations(seen), effects=("stiffness_step",), directions=["x"])


def test_an_instant_is_given_by_its_date_and_the_earthquakes_beside_it(by_a_step: DiagnosisResult) -> None:
    said = r"at 2021-0[34]-\d\d \d\d:\d\d UTC, between the earthquakes of event 1 and event 2, and stayed so\."
    assert re.search(said, by_a_step.text[0])


def test_a_step_may_be_another_temperature_where_none_was_recorded(
    by_a_step: DiagnosisResult, by_two: DiagnosisResult
) -> None:
    assert " ".join(by_a_step.text).count("No temperature was recorded") == 1
    assert "No temperature was recorded" not in " ".join(by_two.text)


@pytest.mark.parametrize(("std", "is_seen"), [(1e7, True), (3e7, False)])
def test_an_amplitude_below_its_deviation_is_said_not_to_be_seen(*, std: float, is_seen: bool) -> None:
    """A wall on the side that the layer never reached."""
    wall = {"gap": 0.09, "gap_back": 0.0956, "wall": 8e7, "wall_back": 2.5e7}
    said = list(unseen("moat", Isolator({"moat": wall}), {"moat": {"wall": 1e6, "wall_back": std}}))
    assert bool(said) is not is_seen
    assert all(one.startswith("No wall_back is seen in these records (stiffness of the contact in") for one in said)


@pytest.fixture(scope="module")
def complete() -> DiagnosisResult:
    """Nothing is missing; the last of four earthquakes is held out."""
    seen = records_from_observations(list(observations(BOUC_WEN, 0.01, 3, (0.02, 0.08, 0.03, 0.05))), {"event 3"})
    return diagnose(BOUC_WEN, seen, effects=("inerter",), directions=["x"])


@pytest.mark.parametrize(
    ("noise_ratio", "held_out", "is_said"), [(1.5, 0.5, True), (1.5, 1.0, True), (1.5, 2.0, False), (0.6, 0.5, False)]
)
def test_an_objection_is_said_where_more_than_noise_is_left_and_the_effect_would_help(
    complete: DiagnosisResult, *, noise_ratio: float, held_out: float, is_said: bool
) -> None:
    """An effect that takes nothing but noise is no evidence, neither for itself nor for a wrong mass.

    Args:
        complete: the diagnosis.
        noise_ratio: that the model leaves.
        held_out: error with the effect over that without it, in held-out earthquakes.
        is_said: whether the objection is.
    """
    (inerter,) = complete.candidates
    before = complete.versions[1].error(("event 3",))
    tried = replace(
        inerter,
        implausible="it moves with the slab",
        delta_bic=-160.0,
        after=replace(complete.before, error=0.2 * complete.before.error),
        after_held_out=replace(before, error=held_out**2 * before.error),
    )
    left = replace(complete.diagnosis.before, noise_ratio=noise_ratio, share=0.0)
    result = replace(complete, candidates=(tried,), diagnosis=replace(complete.diagnosis, before=left))
    assert any(said.startswith("Not proposed because") for said in result.text) == is_said
