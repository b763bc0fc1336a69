from dataclasses import replace
from math import pi

import pytest
from building_models import paper

from core.description import BuildingDescription, IsolationDesign, IsolationLayer
from core.model.first_model import first_model
from core.paper import BUILDING


def designed(**design: float) -> BuildingDescription:
    return replace(paper(), isolation=IsolationLayer(0.2, IsolationDesign(**design)))


def test_design_values_make_the_papers_model() -> None:
    """Table II."""
    model = first_model(designed(k_b=475.0e6, c_b=6.0e6, F_y=655.4e3, D_y=1.5e-3))
    assert list(model.isolator.effects.values())[:2] == [{"k_b": 475.0e6}, {"c_b": 6.0e6}]
    hysteresis = model.isolator.effects["bouc_wen"]
    assert (hysteresis["F_y"], hysteresis["D_y"]) == (655.4e3, 1.5e-3)
    assert hysteresis["beta"] + hysteresis["gamma"] == pytest.approx(hysteresis["A"])  # so that z ends at 1: F_y
    assert model.assumed == ()


def test_without_design_values_the_model_is_linear_and_all_of_it_assumed() -> None:
    model = first_model(designed())
    assert set(model.isolator.effects) == {"elastic", "viscous"}
    assert model.assumed == ("c_b", "k_b")


def test_the_assumed_layer_has_the_stated_period_and_damping() -> None:
    """3 s and 10 %: k = M ω², c = 2 ζ M ω; 0.5 % each, since they are given to three digits."""
    effects = first_model(designed()).isolator.effects
    k, c = effects["elastic"]["k_b"], effects["viscous"]["c_b"]
    assert 2 * pi * (BUILDING.total_mass / k) ** 0.5 == pytest.approx(3.0, rel=5e-3)
    assert c / (2 * (BUILDING.total_mass * k) ** 0.5) == pytest.approx(0.1, rel=1e-2)


def test_what_the_design_leaves_open_is_stated() -> None:
    model = first_model(designed(k_b=475.0e6, F_y=655.4e3))
    assert model.isolator.effects["elastic"]["k_b"] == 475.0e6
    assert model.assumed == ("D_y", "c_b")
