import numpy as np
import pytest
from motions import RATE, akt013

from core.building import fixed_base_modes
from core.errors import RecordError
from core.isolator import Conditions, Isolator
from core.modal_response import respond
from core.paper import BUILDING, ISOLATOR
from core.simulation import simulate

LINEAR = Isolator({"elastic": {"k_b": 475e6}, "viscous": {"c_b": 6e6}})


@pytest.mark.parametrize("isolator", [LINEAR, ISOLATOR])
@pytest.mark.parametrize(
    "quantity",
    ["isolator_displacement", "isolator_velocity", "force", "base_acceleration", "floor_acceleration"],
)
def test_a_shear_building_responds_alike_by_its_storeys_and_by_its_modes(isolator: Isolator, quantity: str) -> None:
    """The same equations in other coordinates, by the same method and steps: to rounding."""
    ground = akt013()[:4000]
    usual = Conditions.usual(ground.size, RATE)
    modal = getattr(respond(fixed_base_modes(BUILDING), BUILDING.base_mass, isolator, ground, RATE, usual), quantity)
    physical = getattr(simulate(BUILDING, isolator, ground, RATE), quantity)
    assert modal == pytest.approx(physical, abs=1e-10 * np.abs(physical).max())


def test_gaps_are_refused() -> None:
    ground = np.full(1000, np.nan)
    with pytest.raises(RecordError, match="without gaps"):
        respond(fixed_base_modes(BUILDING), 1.0, LINEAR, ground, RATE, Conditions.usual(1000, RATE))
