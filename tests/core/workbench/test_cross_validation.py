"""Effects added because they predict earthquakes that were left out, against a law that is known."""

import pytest
from synthetic_observations import BOUC_WEN, observations

from core.model.isolator import Isolator
from core.workbench import cross_validation
from core.workbench.cross_validation import Validated, can_validate, is_exhausted, validated
from core.workbench.earthquakes import Earthquakes, silent
from core.workbench.fitting import fit

HARD = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 8e10, "k5": 0.0}})
OFFERED = ("hardening", "friction", "stiffness_step")


def seen(truth: Isolator = HARD) -> Earthquakes:
    return Earthquakes.of(observations(truth, 0.02, seed=3, peaks=(0.05, 0.08, 0.06), seconds=21.0))


@pytest.fixture(scope="module")
def steps() -> list[Validated]:
    """From a model with a useless friction."""
    earthquakes = seen()
    begun = fit(Isolator({**BOUC_WEN.effects, "friction": {}}), earthquakes).model
    return list(validated(begun, earthquakes, BOUC_WEN.effects, OFFERED, silent))


def test_the_right_effect_is_added_and_the_stand_in_removed(steps: list[Validated]) -> None:
    """Beside hardening friction predicts nothing; a step in time is not tried, though it is offered."""
    assert [(one.change, one.is_added) for one in steps] == [("", True), ("hardening", True), ("friction", False)]
    assert set(steps[-1].model.effects) == set(HARD.effects)
    assert steps[0].error > 2 * steps[1].error
    assert steps[-1].error < 0.03
    assert list(steps[-1].errors) == ["event 0", "event 1", "event 2"]


def test_a_search_that_may_add_no_more_effects_is_told_from_one_that_found_none(
    steps: list[Validated], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not is_exhausted(steps)
    monkeypatch.setattr(cross_validation, "MOST_ADDED", sum(step.is_added for step in steps[1:]))
    assert is_exhausted(steps)


def test_a_term_that_no_record_makes_act_stays_zero(steps: list[Validated]) -> None:
    """The fifth power takes nothing from this law, and beyond the records it would be anything."""
    assert steps[-1].zero == {("hardening", "k5")}
    assert steps[-1].model.effects["hardening"]["k5"] == 0
    assert steps[-1].model.effects["hardening"]["k3"] == pytest.approx(8e10, rel=0.1)


def test_a_later_fit_leaves_such_a_term_at_zero_and_says_so(steps: list[Validated]) -> None:
    later = fit(steps[-1].model, seen())
    assert later.zero == {("hardening", "k5")}
    assert later.model.effects["hardening"] == {"k3": pytest.approx(8e10, rel=0.1), "k5": 0}
    assert "The term k5 of hardening (force over its fifth power) is 0 in the model and stays 0" in later.fit_text[-1]


def test_a_later_fit_frees_the_term_once_records_make_it_act() -> None:
    """In earthquakes whose layer has the fifth power, of a size that matters."""
    truth = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 8e10, "k5": 5e13}})
    given = Isolator({**BOUC_WEN.effects, "hardening": {"k3": 8e10, "k5": 0.0}})
    later = fit(given, seen(truth))
    assert later.zero == frozenset()
    assert later.model.effects["hardening"]["k5"] == pytest.approx(5e13, rel=0.1)
    assert not any("stays 0" in sentence for sentence in later.fit_text)


def test_nothing_is_added_where_nothing_is_missing() -> None:
    """Though each takes a little where it is fitted."""
    offered = ("displacement_damping", "hardening", "power_viscous", "recent_softening")
    (only,) = validated(BOUC_WEN, seen(BOUC_WEN), BOUC_WEN.effects, offered, silent)
    assert (only.change, set(only.model.effects)) == ("", set(BOUC_WEN.effects))


def test_one_earthquake_cannot_be_left_out() -> None:
    earthquakes = seen()
    assert can_validate(Earthquakes.of(earthquakes, earthquakes.fitted_names[:1]))
    assert not can_validate(Earthquakes.of(earthquakes, earthquakes.fitted_names[:2]))
