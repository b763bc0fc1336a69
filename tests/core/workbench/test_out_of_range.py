"""A model that fits weak earthquakes and fails in a strong one is out of its range, which is stated with its limit."""

from dataclasses import replace

import pytest
from records_from_observations import records_from_observations
from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.missing_effects import Outcome
from core.model.isolator import Isolator
from core.workbench.diagnosing import diagnose
from core.workbench.diagnosis_result import DiagnosisResult
from core.workbench.earthquakes import Earthquakes, model_errors
from core.workbench.out_of_range import out_of_range, range_sentences

OFFERED = ("hardening", "power_viscous")
HARD = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 2e10, "k5": 0.0}})
WEAK_THEN_STRONG = (0.010, 0.012, 0.009, 0.080)
STRONG = "event 3"


def seen(truth: Isolator, seed: int = 3) -> Earthquakes:
    return records_from_observations(observations(truth, 0.02, seed, WEAK_THEN_STRONG), {STRONG})


@pytest.fixture(scope="module")
def result() -> DiagnosisResult:
    return diagnose(BOUC_WEN, seen(HARD), effects=OFFERED)


def test_the_outcome_is_out_of_range_with_the_limits(result: DiagnosisResult) -> None:
    assert result.outcome == "out_of_range"
    (one,) = result.out_of_range
    assert (one.name, one.direction) == (STRONG, "x")
    assert one.noise_ratio > 2 > 1.5 > one.noise_ratio_fitted
    by_name = {part.quantity: part for part in one.exceeded}
    assert by_name["displacement"].limit == pytest.approx(0.012, rel=0.01)
    assert by_name["displacement"].reached == pytest.approx(0.080, rel=0.01)
    assert by_name["displacement"].share > 0.9
    assert by_name["temperature"].reached == pytest.approx(40.0)


def test_the_text_says_where_and_advises_to_fit_with_the_record(result: DiagnosisResult) -> None:
    text = " ".join(result.text)
    assert "fits what it was fitted to and fails beyond its range" in text
    assert "Its largest displacement, 80 mm, is beyond that of the fitted earthquakes, 12 mm" in text
    assert "Fit with these records" in text
    assert "No known effect is missing" not in text


def test_a_model_that_predicts_the_strong_one_too_is_in_range() -> None:
    found = diagnose(BOUC_WEN, seen(BOUC_WEN), effects=OFFERED)
    assert found.out_of_range == ()
    assert found.diagnosis.outcome in {Outcome.NOTHING_MISSING, Outcome.REFIT}


def test_a_model_that_fails_where_it_was_fitted_is_not_out_of_range() -> None:
    known = records_from_observations(observations(HARD, 0.02, 4, (0.08, 0.07, 0.06, 0.08)), {STRONG})
    assert out_of_range(model_errors(BOUC_WEN, known), known) == ()


def test_a_change_between_earthquakes_of_one_range_is_said_to_be_one() -> None:
    soft = Isolator({**BOUC_WEN.effects, "elastic": {"k_b": 300e6}})
    sound, changed = (observations(one, 0.02, 5, (0.05, 0.05, 0.04, 0.04)) for one in (BOUC_WEN, soft))
    each = tuple(
        replace(one, conditions=replace(one.conditions, temperature=0 * one.conditions.temperature + 20))
        for one in (*sound[:3], changed[3])
    )
    known = records_from_observations(each, {STRONG})
    (one,) = out_of_range(model_errors(BOUC_WEN, known), known)
    assert one.exceeded == ()
    assert "something else changed between them" in " ".join(range_sentences([one]))
