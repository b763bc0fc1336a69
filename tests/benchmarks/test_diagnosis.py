"""A few trials of the benchmark of the diagnosis, whose table is in docs: what is hidden is named, and nothing else."""

import pytest

from benchmarks.diagnosis_trial import row

pytestmark = pytest.mark.accuracy


@pytest.mark.parametrize(("case", "seed"), [("maxwell", 1), ("hardening+relief", 1), ("pinching", 105)])
def test_what_is_hidden_is_named_and_predicts_a_new_earthquake(case: str, seed: int) -> None:
    """By laws of the library's form: nothing is left but noise, and the model's error falls by half at least.

    Without its pinching, this damper is fitted with a sixth of its yield force, beside which pinching does nothing.
    """
    found = row(case, seed)
    assert set(found.named) == set(found.hidden)
    assert not found.unknown
    assert found.after < 1.25 < found.before
    assert found.predicted < 0.5 * found.predicted_before


@pytest.mark.parametrize(("case", "outcomes"), [("nothing+gains", {"nothing_missing", "refit"}), ("mass", {"mass"})])
def test_no_effect_is_named_where_none_is_missing(case: str, outcomes: set[str]) -> None:
    found = row(case, 1)
    assert found.outcome in outcomes
    assert found.named == ()


def test_a_law_of_no_effect_of_the_library_is_reported_as_unknown() -> None:
    assert row("delayed_feedback", 1).unknown
