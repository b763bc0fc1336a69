from dataclasses import replace

import numpy as np
import pytest
from ground_motions import RATE, akt013, kobe

from core.building import fixed_base_modes
from core.errors import RecordError
from core.model.isolator import Conditions, Isolator
from core.model.modal_response import Axis, respond, respond_together
from core.model.simulation import Response, simulate
from core.paper import BUILDING, ISOLATOR

LINEAR = Isolator({"elastic": {"k_b": 475e6}, "viscous": {"c_b": 6e6}})
COUPLED = Isolator({**ISOLATOR.effects, "biaxial": {"joined": 1.0, "D_cross": 1.5e-3}})
MODES = fixed_base_modes(BUILDING)


@pytest.mark.parametrize("isolator", [LINEAR, ISOLATOR])
@pytest.mark.parametrize(
    "quantity",
    ["isolator_displacement", "isolator_velocity", "force", "base_acceleration", "floor_acceleration"],
)
def test_a_shear_building_responds_alike_by_its_storeys_and_by_its_modes(isolator: Isolator, quantity: str) -> None:
    """The same equations in other coordinates, by the same method and steps: to rounding."""
    ground = akt013()[:4000]
    usual = Conditions.usual(ground.size, RATE)
    axis = Axis(MODES, ground, usual)
    modal = getattr(respond(axis, BUILDING.base_mass, isolator, RATE), quantity)
    physical = getattr(simulate(BUILDING, isolator, ground, RATE), quantity)
    assert modal == pytest.approx(physical, abs=1e-10 * np.abs(physical).max())


def coupled(isolator: Isolator) -> tuple[Response, Response]:
    """Two recorded motions at once."""
    count = 4000
    axes = [Axis(MODES, motion()[:count], Conditions.usual(count, RATE)) for motion in (akt013, kobe)]
    x, y = respond_together(axes, BUILDING.base_mass, isolator, RATE)
    return x, y


def test_two_directions_that_know_nothing_of_each_other_respond_as_each_alone() -> None:
    for motion, found in zip((akt013, kobe), coupled(ISOLATOR), strict=True):
        alone = respond(Axis(MODES, motion()[:4000], Conditions.usual(4000, RATE)), BUILDING.base_mass, ISOLATOR, RATE)
        assert found.isolator_displacement == pytest.approx(alone.isolator_displacement, abs=0)
        assert found.floor_acceleration == pytest.approx(alone.floor_acceleration, abs=0)


def test_each_direction_sees_the_other_as_it_is_computed() -> None:
    """One direction alone, told what the other did at each sample: the same but for what that does between samples."""
    x, y = coupled(COUPLED)
    for ground, own, other in ((akt013, x, y), (kobe, y, x)):
        usual = Conditions.usual(4000, RATE)
        told = replace(usual, u_cross=other.isolator_displacement, v_cross=other.isolator_velocity)
        for given, low, high in ((told, 0.0, 2e-4), (usual, 0.05, 1.0)):
            alone = respond(Axis(MODES, ground()[:4000], given), BUILDING.base_mass, COUPLED, RATE)
            apart = np.linalg.norm(alone.isolator_displacement - own.isolator_displacement)
            assert low <= apart / np.linalg.norm(own.isolator_displacement) < high


def test_gaps_are_refused() -> None:
    ground = np.full(1000, np.nan)
    with pytest.raises(RecordError, match="without gaps"):
        respond(Axis(MODES, ground, Conditions.usual(1000, RATE)), 1.0, LINEAR, RATE)
