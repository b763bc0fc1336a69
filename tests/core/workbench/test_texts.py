"""Sentences of the workbench: what remains once effects are added, and the explanation of an effect with its values."""

import re

import pytest
from records_from_observations import records_from_observations
from synthetic_observations import BOUC_WEN, observations

from core.diagnosis.unexplained import Unexplained
from core.diagnosis.worth import Worth
from core.effect import Effect, LogNormal, Parameter, explained
from core.effects import EFFECTS
from core.model.isolator import Isolator
from core.workbench.texts import action, remaining, unexplained_share


def test_an_error_that_follows_the_motion_shows_that_the_model_is_incomplete() -> None:
    said = remaining(Unexplained(share=0.372, noise_ratio=88.7, allowed=1.25), 1)
    assert said == (
        "With this effect, the error is still 88.7 times the noise, and 37.2 % of its power follows the motion: "
        "the model is incomplete."
    )


def test_an_error_that_does_not_follow_the_motion_is_not_called_structure() -> None:
    said = remaining(Unexplained(share=-0.01, noise_ratio=1.4, allowed=1.25), 2)
    assert said == (
        "With these effects, the error is still 1.4 times the noise. A regression on powers and delays of the "
        "motion, hysteresis, travel, vertical load, temperature and the other direction predicts less than 5.0 % of "
        "its power; an abrupt contact, for example, would not show in it."
    )


def test_a_share_that_rounds_to_nothing_is_said_to_be_small() -> None:
    said = unexplained_share(Worth(fitted=1.0, held_out=0.9996))
    assert said.endswith(
        "less than 0.1 % is unexplained where it was fitted and less than 0.1 % on held-out earthquakes."
    )
    assert ", 0.1 % is unexplained" in unexplained_share(Worth(fitted=0.9994, held_out=None))


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_values_are_in_the_units_that_engineers_read(name: str) -> None:
    effect = EFFECTS[name]
    printed = explained(effect, {parameter.name: parameter.prior.median for parameter in effect.parameters})
    assert not re.search(r"\d (N|m|kg)\b", printed), printed


def test_a_value_has_its_unit_or_by_a_format_the_si_number() -> None:
    """As an effect of one's own may have it either way."""
    drag = Effect(
        title="Water drag",
        law=lambda v, drag, F_0: drag * v * abs(v) + F_0,
        parameters=(
            Parameter("drag", "N s2/m2", (0.0, 1e12), LogNormal(1e6, 2.0), "force at 1 m/s"),
            Parameter("F_0", "N", (0.0, 1e9), LogNormal(1e5, 2.0), "always there"),
        ),
        absent={"drag": 0.0},
        family="viscosity",
        explanation="Water resists with {drag:.3g} N at 1 m/s, that is {drag}, and with {F_0} always.",
        suspect_when="The pit is flooded.",
        source="Morison et al. (1950), eq 2",
    )
    printed = explained(drag, {"drag": 1.25e6, "F_0": 123456.0})
    assert printed == "Water resists with 1.25e+06 N at 1 m/s, that is 1,250,000 N s2/m2, and with 123 kN always."
    assert explained(drag, None) == "Water resists with drag N at 1 m/s, that is drag, and with F_0 always."


@pytest.mark.parametrize(("unloading", "is_told"), [(0.002, False), (0.5, True)])
def test_a_form_is_told_if_it_is_not_nearly_the_usual_one(unloading: float, *, is_told: bool) -> None:
    values = {"sliding": 1e6, "share": 0.5, "a": 30.0, "slip": 5e-4, "unloading": unloading}
    model = Isolator({**BOUC_WEN.effects, "friction": values})
    seen = records_from_observations(list(observations(BOUC_WEN, 0.01, 1)))
    assert ("The form of its law" in action(model, "friction", seen)) == is_told
