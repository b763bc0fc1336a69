"""Predictions of several earthquakes, in two coupled directions."""

from dataclasses import replace

import numpy as np
import pytest
from biaxial_observations import COUPLED, biaxial_observation
from building_models import paper
from layer_observations import BAND

from core.building import fixed_base_modes
from core.comparison.compared import ForceComparison, compare_forces
from core.comparison.prediction import Predictions, predict_all
from core.fitting.observation import Observation
from core.model.isolator import Isolator
from core.paper import BUILDING

MODES = fixed_base_modes(BUILDING)


@pytest.fixture(scope="module")
def seen() -> tuple[Observation, Observation]:
    return biaxial_observation(1)


def predictions(seen: tuple[Observation, ...]) -> Predictions:
    forces: tuple[ForceComparison, ...] = compare_forces(COUPLED, seen, BAND)
    return predict_all(forces, {"x": MODES, "y": MODES}, COUPLED, paper(), BAND)


def test_both_directions_are_predicted_from_their_grounds_alone(seen: tuple[Observation, Observation]) -> None:
    """No direction knows how the other one moved. 0.1 %: as test_prediction."""
    x, y = (replace(one, conditions=replace(one.conditions, u_cross=0 * one.conditions.u_cross)) for one in seen)
    result = predictions((x, replace(y, conditions=replace(y.conditions, v_cross=-y.conditions.v_cross))))
    assert [one.observation.direction for one in result.each] == ["x", "y"]
    assert all(one.displacement.misfit.nrmse < 1e-3 for one in result.each)
    assert result.remarks == ()


def test_a_direction_that_cannot_be_predicted_is_reported_to_the_other_as_it_was_measured(
    seen: tuple[Observation, Observation],
) -> None:
    """0.5 %: it is given at the samples, and straight between them."""
    result = predictions((seen[0], replace(seen[1], ground_acceleration=None)))
    (x,) = result.each
    assert x.displacement.misfit.nrmse < 5e-3
    name = seen[0].name
    assert result.remarks == (
        f"{name}, direction y: the ground's acceleration was not measured; the model has no excitation",
        f"{name}: motion in the other direction is given as measured, not predicted",
    )


def test_what_cannot_be_computed_is_stated_and_the_other_earthquakes_are_there(
    seen: tuple[Observation, Observation],
) -> None:
    later = tuple(
        replace(one, name="later", start=one.start.replace(year=2025), ground_acceleration=np.full(6000, np.nan))
        for one in seen
    )
    result = predictions((*seen, *later))
    assert [one.observation.name for one in result.each] == [seen[0].name] * 2
    (remark,) = result.remarks
    assert remark.startswith("later: the ground acceleration must be one series without gaps")


def test_the_coupling_matters_here(seen: tuple[Observation, Observation]) -> None:
    """Or the tests above would hold for a prediction that leaves it out."""
    forces = compare_forces(COUPLED, seen, BAND)
    apart = Isolator({name: values for name, values in COUPLED.effects.items() if name != "biaxial"})
    result = predict_all(forces, {"x": MODES, "y": MODES}, apart, paper(), BAND)
    assert all(one.displacement.misfit.nrmse > 0.03 for one in result.each)
